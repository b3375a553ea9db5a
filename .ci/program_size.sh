#!/usr/bin/env bash
# Prints the size of the release program in bytes; fails above the limit that
# docs/how-to/release.md states.
set -euo pipefail
cd "$(dirname "$0")/.."
limit=20000000
size="$(stat -c %s "${CARGO_TARGET_DIR:-target}/release/grainwake")"
echo "$size"
[ "$size" -le "$limit" ] || { echo "the program has $size bytes, more than $limit" >&2; exit 1; }
