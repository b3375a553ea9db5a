#!/usr/bin/env bash
# Builds the documentation site into target/site; a dead link or a warning is an error.
# Needs the output of .ci/python.sh (wheel, executed notebooks) in target/site-input. The program
# is $GRAINWAKE, or built if that is empty.
set -euo pipefail
cd "$(dirname "$0")/.."
started=$SECONDS
target="${CARGO_TARGET_DIR:-$PWD/target}"
export SITE_INPUT="$target/site-input" SITE_API="$target/site-input/api"
export PIP_DISABLE_PIP_VERSION_CHECK=1 NO_MKDOCS_2_WARNING=true

wheel="$(ls "$SITE_INPUT"/grainwake-*.whl 2>/dev/null | head -1 || true)"
[ -n "$wheel" ] || { echo "no wheel in $SITE_INPUT: run .ci/python.sh first" >&2; exit 1; }
command -v npm >/dev/null || { apt-get update -q && apt-get install -qy nodejs npm; }

# 1. Programs of pinned versions; the environment is kept between builds.
stamp="$(sha256sum .ci/site/requirements.txt "$wheel" | sha256sum | cut -c1-16)"
env="$target/site-env"
if [ "$(cat "$env/stamp" 2>/dev/null)" != "$stamp" ]; then
  rm -rf "$env"
  python3 -m venv "$env"
  "$env/bin/pip" install -q -r .ci/site/requirements.txt "$wheel"
  echo "$stamp" > "$env/stamp"
fi
(cd .ci/site && npm ci --no-audit --no-fund --ignore-scripts --silent)

# 2. Generated pages.
program="${GRAINWAKE:-}"
if [ -z "$program" ]; then
  cargo build --release --quiet
  program="$target/release/grainwake"
fi
"$env/bin/python" .ci/site/commands.py "$program" > "$SITE_INPUT/commands.md"
"$env/bin/python" .ci/site/api.py "$SITE_INPUT/api"
"$env/bin/python" .ci/site/gallery.py --check
RUSTDOCFLAGS="-D warnings" cargo doc --release --workspace --no-deps --quiet

# 3. The site. The page 404.html has absolute links and serves no site below a host's root.
site="$target/site"
rm -rf "$site"
"$env/bin/mkdocs" build --quiet --strict --site-dir "$site"
mkdir -p "$site/assets/katex" "$site/rust"
katex=.ci/site/node_modules/katex
cp -r "$katex/dist/katex.min.css" "$katex/dist/katex.min.js" "$katex/dist/fonts" \
  "$katex/dist/contrib/auto-render.min.js" "$katex/LICENSE" "$site/assets/katex/"
cp .ci/site/node_modules/iframe-worker/shim/index.js "$site/assets/iframe-worker.js"
rm -f "$site/404.html" "$site"/assets/katex/fonts/*.ttf "$site"/assets/katex/fonts/*.woff
cp -r "$target/doc/." "$site/rust/"
"$env/bin/python" .ci/site/links.py "$site"
echo "site: built in $((SECONDS - started)) s, $(du -sm "$site" | cut -f1) MB in $site"
