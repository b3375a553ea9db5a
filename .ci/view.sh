#!/usr/bin/env bash
# Checks the interactive page: the committed bundle is what its sources give, and the browser tests
# pass. Installs npm packages and Chromium if they are missing.
# Usage: .ci/view.sh [RUN]; RUN is a finished run folder of cases/dkt-pair/quick.toml.
# The program is $GRAINWAKE, or built if that is empty.
set -euo pipefail
cd "$(dirname "$0")/.."

command -v npm >/dev/null || { apt-get update -q && apt-get install -qy nodejs npm; }
export CHROMIUM="${CHROMIUM:-$(command -v chromium || true)}"
if [ -z "$CHROMIUM" ]; then
  apt-get update -q && apt-get install -qy --no-install-recommends chromium
  CHROMIUM="$(command -v chromium)"
fi

web=crates/view/web
(cd "$web" && npm ci --no-audit --no-fund --ignore-scripts --silent && node build.mjs --check)

if [ -z "${GRAINWAKE:-}" ]; then
  cargo build --release --quiet
  export GRAINWAKE="${CARGO_TARGET_DIR:-$PWD/target}/release/grainwake"
fi
if [ $# -gt 0 ]; then
  RUN="$(realpath "$1")"
else
  folder="$(mktemp -d)"
  trap 'rm -rf "$folder"' EXIT
  RUN="$folder/quick"
  "$GRAINWAKE" run cases/dkt-pair/quick.toml -o "$RUN" --quiet
fi
export RUN
cd "$web"
npm test --silent
