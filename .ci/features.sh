#!/usr/bin/env bash
# Checks that builds of the program and of the Python package have the features of dependencies that
# a build of the whole workspace with its tests has. Otherwise Cargo compiles these dependencies, and
# all crates that use them, several times. Missing features belong in crates/features/Cargo.toml.
set -euo pipefail
cd "$(dirname "$0")/.."

dependencies() { # ARGUMENTS
  cargo tree --prefix none -f '{p} [{f}]' "$@" | sed 's/ (\*)$//' | LC_ALL=C sort -u
}

all="$(dependencies --workspace -e normal,build,dev)"
for package in grainwake grainwake-python; do
  other="$(LC_ALL=C comm -23 <(dependencies -p "$package" -e normal,build) <(echo "$all"))"
  if [ -n "$other" ]; then
    echo "$package: other features than in a build of the workspace:" >&2
    echo "$other" >&2
    exit 1
  fi
done
