#!/usr/bin/env bash
# Fuzzes the readers of files: libFuzzer with the address sanitizer, at most 2 GB and 10 s an input.
# Needs a nightly toolchain and `cargo install cargo-fuzz`.
#
#   .ci/fuzz.sh SECONDS [TARGET ...]      without targets, all of fuzz/targets
#
# Seeds lie in fuzz/seeds, found inputs in target/fuzz-corpus, crashes in target/fuzz-artifacts.
# A crash ends the script. It is repeated by
# `cargo +nightly fuzz run --target-dir target/fuzz TARGET FILE`.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds="${1:?usage: .ci/fuzz.sh SECONDS [TARGET ...]}"
shift
[ $# -gt 0 ] || set -- case checkpoint grain mesh study tables volume
# The versions of the dependencies are those of the program.
cp Cargo.lock fuzz/Cargo.lock
for target in "$@"; do
  corpus="target/fuzz-corpus/$target"
  artifacts="target/fuzz-artifacts/$target"
  mkdir -p "$corpus" "$artifacts"
  dictionary="fuzz/dictionaries/$target.dict"
  [ -f "$dictionary" ] && dictionary="-dict=$dictionary" || dictionary=""
  nice -n 19 cargo +nightly fuzz run --target-dir target/fuzz "$target" \
    "$corpus" "fuzz/seeds/$target" -- -max_total_time="$seconds" -rss_limit_mb=2048 -timeout=10 \
    -malloc_limit_mb=1024 -max_len=65536 -artifact_prefix="$PWD/$artifacts/" \
    -print_final_stats=1 $dictionary
done
rm -rf /dev/shm/grainwake-fuzz-*
