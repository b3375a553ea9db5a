#!/usr/bin/env bash
# Checks licences and sources of all dependencies against deny.toml, without a network. Installs
# cargo-deny if it is missing, which takes minutes: the release recipe runs this script, CI does not.
set -euo pipefail
cd "$(dirname "$0")/.."
version=0.20.2

if ! cargo deny --version >/dev/null 2>&1; then
  cargo install --locked --quiet "cargo-deny@$version"
fi
cargo fetch --locked --quiet
cargo deny --offline --locked check licenses bans sources
