#!/usr/bin/env bash
# Tests the wheel of the Python package in clean environments, checks its types and runs the
# notebooks. The executed notebooks are kept for .ci/site.sh. Bound: each notebook below 60 s.
# The wheel is $WHEEL, in target/site-input, or built by .ci/wheel.sh if that is empty. The program
# is $GRAINWAKE, or built if that is empty.
set -euo pipefail
cd "$(dirname "$0")/.."
root="$PWD"
started=$SECONDS

work="$(mktemp -d)"
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
export PIP_DISABLE_PIP_VERSION_CHECK=1

wheel="${WHEEL:-$(bash .ci/wheel.sh)}"
input="$(dirname "$wheel")"

# 1. An environment without optional packages: the example of the manual.
python3 -m venv "$work/plain"
"$work/plain/bin/pip" install -q "$wheel"
python3 .ci/first_example.py docs/python.md > "$work/first.py"
(cd "$work" && "$work/plain/bin/python" first.py)
(cd "$work" && "$work/plain/bin/python" "$root/.ci/imports.py")

# 2. Tests with optional packages; beside them on another core the types and the statistics of the
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
