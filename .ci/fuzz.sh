#!/usr/bin/env bash
# Fuzzes the readers of files: libFuzzer with the address sanitizer, at most 2 GB and 10 s an input
# (FUZZ_TIMEOUT: longer on a busy machine, since this is wall time).
# Needs a nightly toolchain and `cargo install cargo-fuzz`.
#
#   .ci/fuzz.sh SECONDS [TARGET ...]      fuzzes; without targets, all of fuzz/targets
#   .ci/fuzz.sh keep [TARGET ...]         keeps the inputs that add coverage in fuzz/corpus
#
# Sound files lie in fuzz/seeds, kept inputs of at most 4 KB in fuzz/corpus, found inputs in
# target/fuzz-corpus, crashes in target/fuzz-artifacts. A crash ends the script. It is repeated by
# `cargo +nightly fuzz run --target-dir target/fuzz TARGET FILE`.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds="${1:?usage: .ci/fuzz.sh SECONDS|keep [TARGET ...]}"
shift
timeout="${FUZZ_TIMEOUT:-10}"
[ $# -gt 0 ] || set -- case checkpoint grain mesh study tables volume
# The versions of the dependencies are those of the program.
cp Cargo.lock fuzz/Cargo.lock

fuzz() { # TARGET ARGUMENTS
  local target="$1"
  shift
  nice -n 19 cargo +nightly fuzz run --target-dir target/fuzz "$target" "$@"
}

for target in "$@"; do
  corpus="target/fuzz-corpus/$target"
  artifacts="target/fuzz-artifacts/$target"
  kept="fuzz/corpus/$target.tar.xz"
  mkdir -p "$corpus" "$artifacts"
  if [ "$seconds" = keep ]; then
    small="$(mktemp -d)"
    mkdir -p fuzz/corpus
    fuzz "$target" "$small" "$corpus" "fuzz/seeds/$target" -- -merge=1 -max_len=4096 -timeout="$timeout"
    # Sorted names and fixed times give the same archive for the same inputs.
    (cd "$small" && find . -type f -printf '%P\n' | LC_ALL=C sort) |
      tar -C "$small" -T - --mtime=@0 --owner=0 --group=0 --mode=644 -cJf "$kept"
    rm -r "$small"
    continue
  fi
  [ ! -f "$kept" ] || tar -xJf "$kept" -C "$corpus" --skip-old-files
  dictionary="fuzz/dictionaries/$target.dict"
  [ -f "$dictionary" ] && dictionary="-dict=$dictionary" || dictionary=""
  fuzz "$target" "$corpus" "fuzz/seeds/$target" -- -max_total_time="$seconds" \
    -rss_limit_mb=2048 -timeout="$timeout" -malloc_limit_mb=1024 -max_len=65536 \
    -artifact_prefix="$PWD/$artifacts/" -print_final_stats=1 $dictionary
done
# Folders of targets that have ended.
for folder in /dev/shm/grainwake-fuzz-*; do
  [ -d "/proc/${folder##*-}" ] || rm -rf "$folder"
done
