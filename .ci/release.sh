#!/usr/bin/env bash
# Builds and tests the artefacts of a release: program, shell completions, manual pages, wheel,
# licences, checksums. docs/how-to/release.md describes the recipe.
# Usage: .ci/release.sh [DIR]; the artefacts are written to DIR (target/release-artefacts).
set -euo pipefail
cd "$(dirname "$0")/.."
root="$PWD"
started=$SECONDS
say() { echo "release: $* ($((SECONDS - started)) s)"; }
fail() { echo "release: $*" >&2; exit 1; }

out="${1:-target/release-artefacts}"
rm -rf "$out"
mkdir -p "$out"
out="$(realpath "$out")"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
export PIP_DISABLE_PIP_VERSION_CHECK=1

# 1. The state: no changes, and licences that a binary may contain.
[ -z "$(git status --porcelain)" ] || fail "uncommitted changes; commit or stash them"
commit="$(git rev-parse --short=12 HEAD)"
bash .ci/licences.sh
say "licences and sources accepted"

# 2. The program with completions, manual pages and licences, as one archive.
cargo build --release --locked --quiet -p grainwake
program="${CARGO_TARGET_DIR:-$root/target}/release/grainwake"
size="$(bash .ci/program_size.sh)"
version="$("$program" -V | cut -d' ' -f2)"
"$program" --version | grep -q "(commit $commit)" || fail "--version lacks the commit $commit"
name="grainwake-$version-$(rustc -vV | sed -n 's/^host: //p')"
tree="$work/$name"
mkdir -p "$tree/bin" "$tree/share/man/man1"
cp "$program" "$tree/bin/"
cp README.md CHANGELOG.md LICENSE-* CITATION.cff "$tree/"
python3 .ci/third_party.py > "$tree/THIRD-PARTY.txt"
"$program" man -o "$tree/share/man/man1" >/dev/null
completions="$tree/share/bash-completion/completions/grainwake
$tree/share/zsh/site-functions/_grainwake
$tree/share/fish/vendor_completions.d/grainwake.fish"
for file in $completions; do
  mkdir -p "$(dirname "$file")"
done
"$program" completions bash > "$tree/share/bash-completion/completions/grainwake"
"$program" completions zsh > "$tree/share/zsh/site-functions/_grainwake"
"$program" completions fish > "$tree/share/fish/vendor_completions.d/grainwake.fish"
tar -C "$work" --owner=0 --group=0 --sort=name -czf "$out/$name.tar.gz" "$name"
say "program of $((size / 1000)) kB, archive of $(($(stat -c %s "$out/$name.tar.gz") / 1000)) kB"

# 3. The wheel.
python3 -m venv "$work/build"
"$work/build/bin/pip" install -q 'maturin>=1.9,<2'
PATH="$work/build/bin:$PATH" maturin build --release --locked --quiet \
  -m crates/python/Cargo.toml -o "$out"
wheel="$(ls "$out"/grainwake-*.whl)"
say "wheel of $(($(stat -c %s "$wheel") / 1000)) kB"

(cd "$out" && sha256sum -- *.tar.gz *.whl > SHA256SUMS)

# 4. Tests of what was written, in empty folders, away from the source tree.
mkdir "$work/user"
cd "$work/user"
(cd "$out" && sha256sum --check --quiet SHA256SUMS)
tar xzf "$out/$name.tar.gz"
installed="$work/user/$name"
grainwake="$installed/bin/grainwake"
"$grainwake" --version
bash -n "$installed/share/bash-completion/completions/grainwake"
bash -c 'source "$1"; COMP_WORDS=(grainwake val); COMP_CWORD=1; _grainwake grainwake val grainwake
  [ "${COMPREPLY[0]}" = validate ]' _ "$installed/share/bash-completion/completions/grainwake"
for shell in zsh fish; do
  if command -v "$shell" >/dev/null; then
    "$shell" -n "$(find "$installed/share/$shell" -type f)"
  fi
done
for page in "$installed"/share/man/man1/*.1; do
  head -c 3 "$page" | grep -q '^\.ie\|^\.TH' || fail "$page is not roff"
  if command -v groff >/dev/null; then
    [ -z "$(groff -man -Tascii -ww "$page" 2>&1 >/dev/null)" ] || fail "groff warns of $page"
  fi
done
"$grainwake" grain make sphere "2 mm" --nodes 500 -o ball.grain >/dev/null
cat > case.toml <<'CASE'
[fluid]
density = 1000
viscosity = "5 mPa s"
[domain]
size = ["4 mm", "4 mm", "12 mm"]
cell_size = "0.5 mm"
boundaries = { x = "periodic", y = "periodic" }
[time]
end = "40 ms"
[[grain]]
file = "ball.grain"
density = 2500
position = ["2 mm", "2 mm", "10 mm"]
CASE
"$grainwake" check case.toml >/dev/null
"$grainwake" run case.toml -o runs/ball --quiet
grep -q "\"commit\": \"$commit\"" runs/ball/provenance.json || fail "provenance without commit"
test -s runs/ball/report.html
"$grainwake" view runs/ball --save ball.html >/dev/null
"$grainwake" validate contact/bounce --quiet
say "the program works in an empty folder"
python3 -m venv "$work/plain"
"$work/plain/bin/pip" install -q "$wheel"
python3 "$root/.ci/first_example.py" "$root/docs/python.md" > first.py
"$work/plain/bin/python" first.py
"$work/plain/bin/python" -c "import grainwake; assert grainwake.commit == '$commit'"
say "the wheel works in an empty environment"
ls -l "$out"
