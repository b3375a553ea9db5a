#!/usr/bin/env bash
# Builds the wheel of the Python package into target/site-input, which is emptied before, and prints
# its path. Bound: 15 MB.
set -euo pipefail
cd "$(dirname "$0")/.."
started=$SECONDS

work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
export PIP_DISABLE_PIP_VERSION_CHECK=1

if ! python3 -c 'import ensurepip, venv' 2>/dev/null; then
  apt-get update -q >&2 && apt-get install -qy python3-venv >&2
fi

python3 -m venv "$work/build"
"$work/build/bin/pip" install -q 'maturin>=1.9,<2' >&2
PATH="$work/build/bin:$PATH" maturin build --release --quiet \
  -m crates/python/Cargo.toml -o "$work/wheels" >&2
wheel="$(ls "$work"/wheels/grainwake-*.whl)"
size="$(stat -c %s "$wheel")"
echo "python: wheel of $((size / 1000)) kB after $((SECONDS - started)) s" >&2
test "$size" -le 15000000 || { echo "the wheel is larger than 15 MB" >&2; exit 1; }
input="${CARGO_TARGET_DIR:-$PWD/target}/site-input"
rm -rf "$input"
mkdir -p "$input"
cp "$wheel" "$input/"
echo "$input/$(basename "$wheel")"
