#!/usr/bin/env bash
# Builds the wheel of the Python package, tests it in clean environments, checks its types and runs
# the notebooks. Wheel and executed notebooks are kept for .ci/site.sh. Bounds: wheel at most 15 MB,
# each notebook below 60 s.
# The program is $GRAINWAKE, or built if that is empty.
set -euo pipefail
cd "$(dirname "$0")/.."
root="$PWD"
started=$SECONDS

work="$(mktemp -d)"
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
export PIP_DISABLE_PIP_VERSION_CHECK=1

if ! python3 -c 'import ensurepip, venv' 2>/dev/null; then
  apt-get update -q && apt-get install -qy python3-venv
fi

# 1. The wheel.
python3 -m venv "$work/build"
"$work/build/bin/pip" install -q 'maturin>=1.9,<2'
PATH="$work/build/bin:$PATH" maturin build --release --quiet \
  -m crates/python/Cargo.toml -o "$work/wheels"
wheel="$(ls "$work"/wheels/grainwake-*.whl)"
size="$(stat -c %s "$wheel")"
echo "python: wheel of $((size / 1000)) kB after $((SECONDS - started)) s"
input="${CARGO_TARGET_DIR:-$root/target}/site-input"
rm -rf "$input"
mkdir -p "$input"
cp "$wheel" "$input/"
test "$size" -le 15000000 || { echo "the wheel is larger than 15 MB" >&2; exit 1; }

# 2. An environment without optional packages: the example of the manual.
python3 -m venv "$work/plain"
"$work/plain/bin/pip" install -q "$wheel"
python3 .ci/first_example.py docs/python.md > "$work/first.py"
(cd "$work" && "$work/plain/bin/python" first.py)
(cd "$work" && "$work/plain/bin/python" "$root/.ci/imports.py")

# 3. Tests with optional packages; beside them on another core the types and the statistics of the
# studies by a second route. Then the notebooks, whose time is bounded.
python3 -m venv "$work/full"
"$work/full/bin/pip" install -q "$wheel[all]" pytest mypy pandas-stubs \
  nbclient ipykernel matplotlib trimesh lifelines
program="${GRAINWAKE:-}"
if [ -z "$program" ]; then
  cargo build --release --quiet
  program="${CARGO_TARGET_DIR:-$root/target}/release/grainwake"
fi
(
  cd "$work"
  full/bin/python -m mypy --config-file "$root/crates/python/pyproject.toml" -p grainwake
  full/bin/python -m mypy.stubtest grainwake._grainwake \
    --mypy-config-file "$root/crates/python/pyproject.toml" --allowlist "$root/.ci/stubtest.txt"
  for study in dkt-morphology-ensemble dkt-morphology-members dkt-morphology-repeated \
    dkt-real-grains; do
    full/bin/python "$root/studies/second_route.py" "$root/results/$study" orientation cells
  done
) &
beside=$!
(cd "$work" && GRAINWAKE_CLI="$program" \
  full/bin/python -m pytest -q -p no:cacheprovider "$root/crates/python/tests")
wait "$beside"
(cd "$work" && full/bin/python "$root/.ci/notebooks.py" 60 "$input/notebooks" \
  "$root"/docs/notebooks/*.ipynb)
echo "python: all checks passed in $((SECONDS - started)) s"
