#!/usr/bin/env bash
# Checks the unsafe code. Each check is run alone by its name; without names all but `step` are.
#
#   .ci/sanitize.sh [memcheck] [python] [address] [thread] [miri] [step]
#
# memcheck  valgrind on the release program with two small cases in both precisions, 2 threads
# python    valgrind on the tests of simulations in the Python package, whose arrays show the memory
#           of the solver; undefined values are left out, since the interpreter itself reports some
# address   address sanitizer on the tests of crates/simd, with all instruction sets of the machine
# thread    thread sanitizer on grains that share rows of faces: unit tests of the coupling, and the
#           test `sharing` of crates/solver with up to 4 threads; then on a test that races on
#           purpose, which must be reported
# miri      tests of crates/simd with the instructions of every machine, and tests of the shared rows
#           of fields
# step      a step of two touching grains on 2 threads under Miri; about 12 min of CPU time
#
# A check whose tool is missing is skipped with a note. All but the first two need a nightly
# toolchain, `thread` its component rust-src too; `python` downloads packages.
# The fuzz target `checkpoint` steps whole simulations under the address sanitizer.
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# -gt 0 ] || set -- memcheck python address thread miri
host="$(rustc -vV | sed -n 's/^host: //p')"
export CARGO_INCREMENTAL=0

missing() { echo "$1: skipped, $2"; }

memcheck() {
  command -v valgrind >/dev/null || { missing memcheck "valgrind is not installed"; return; }
  cargo build --release --quiet -p grainwake
  local out case precision
  out="$(mktemp -d)"
  for case in fuzz/seeds/case/wet.toml fuzz/seeds/case/pair.toml; do
    for precision in f64 f32; do
      valgrind --quiet --error-exitcode=99 --leak-check=no target/release/grainwake run "$case" \
        -o "$out/run" --force --quiet --no-report --threads 2 \
        --set "run.precision=\"$precision\"" --set 'time.end="3 ms"'
    done
  done
  rm -r "$out"
  echo "memcheck: no error"
}

python() {
  command -v valgrind >/dev/null || { missing python "valgrind is not installed"; return; }
  local work wall_time=test_the_lock_of_the_interpreter_is_released
  work="$(mktemp -d)"
  python3 -m venv "$work/venv"
  "$work/venv/bin/pip" install -q 'maturin>=1.9,<2' pytest
  PATH="$work/venv/bin:$PATH" maturin build --release --quiet \
    -m crates/python/Cargo.toml -o "$work"
  "$work/venv/bin/pip" install -q "$work"/grainwake-*.whl
  PYTHONMALLOC=malloc valgrind --quiet --error-exitcode=99 --leak-check=no \
    --undef-value-errors=no --suppressions=.ci/valgrind.supp \
    "$work/venv/bin/python" -m pytest -q -p no:cacheprovider -k "not $wall_time" \
    crates/python/tests/test_simulation.py
  rm -r "$work"
  echo "python: no error"
}

address() {
  cargo +nightly --version >/dev/null 2>&1 || { missing address "no nightly"; return; }
  RUSTFLAGS="-Zsanitizer=address -Cunsafe-allow-abi-mismatch=sanitizer -Cdebug-assertions=on" \
    cargo +nightly test --release --target "$host" --target-dir target/address \
    -p grainwake-simd --lib
}

thread() {
  local library
  library="$(rustc +nightly --print sysroot 2>/dev/null)/lib/rustlib/src/rust/library"
  [ -d "$library" ] || { missing thread "no nightly with rust-src"; return; }
  # The sanitizer ignores accesses of more than 16 bytes: kernels use the narrowest registers.
  thread_tests() { # ARGUMENTS
    RUSTFLAGS="-Zsanitizer=thread --cfg narrow_registers" \
      cargo +nightly test -Zbuild-std --release --target "$host" --target-dir target/thread \
      -p grainwake-solver --lib --test sharing -- "$@"
  }
  thread_tests immersed sharing
  # The check can fail: a test that races on purpose must be reported.
  local log
  log="$(mktemp)"
  if thread_tests --ignored at_once_race >"$log" 2>&1 || ! grep -q "data race" "$log"; then
    tail -n 20 "$log" >&2
    echo "thread: the race of a test that races on purpose was not reported" >&2
    exit 1
  fi
  rm "$log"
  echo "thread: no race, and the race on purpose was reported"
}

miri_solver() { # ARGUMENTS
  cargo +nightly miri --version >/dev/null 2>&1 || { missing miri "Miri is not installed"; return; }
  # The thread pool violates stacked borrows, but not tree borrows, and its threads outlive the test.
  local flags="-Zmiri-tree-borrows -Zmiri-ignore-leaks -Zmiri-permissive-provenance"
  MIRIFLAGS="$flags -Zmiri-disable-isolation" \
    cargo +nightly miri test --target-dir target/miri -p grainwake-solver "$@"
}

miri() {
  cargo +nightly miri --version >/dev/null 2>&1 || { missing miri "Miri is not installed"; return; }
  cargo +nightly miri test --target-dir target/miri -p grainwake-simd --lib
  miri_solver --lib -- grid::loops grid::field update::tests
}

step() { miri_solver --test sharing; }

for check in "$@"; do
  case "$check" in
    memcheck) memcheck ;;
    python) python ;;
    address) address ;;
    thread) thread ;;
    miri) miri ;;
    step) step ;;
    *) echo "unknown check: $check" >&2; exit 2 ;;
  esac
done
