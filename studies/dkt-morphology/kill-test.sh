#!/usr/bin/env bash
# Kills the study (kill -9) at five random moments and resumes it each time. Compares all columns of
# its table except the wall time with those of an undisturbed study. The cells of 0.5 mm are too
# coarse for physical results, but take only some minutes.
#
#   studies/dkt-morphology/kill-test.sh [SEED]
set -euo pipefail
cd "$(dirname "$0")/../.."
RANDOM="${1:-1}"
out="$(mktemp -d)"
trap 'rm -rf "$out"' EXIT
cargo build --release --quiet
study() {
  exec target/release/grainwake study studies/dkt-morphology/quick.toml \
    --jobs 2 --quiet -o "$out/$1" \
    --set 'domain.cell_size="0.5 mm"' --set 'output.checkpoint_interval="2 s"' >/dev/null
}
begin=$SECONDS
(study whole)
length=$((SECONDS - begin))
echo "undisturbed: $length s"
for kill in 1 2 3 4 5; do
  (study killed) & child=$!
  sleep "$((RANDOM % (length / 5 + 1) + 1)).$((RANDOM % 1000))"
  kill -9 "$child" || { echo "the study ended before kill $kill" >&2; exit 1; }
  echo "kill $kill: $(find "$out/killed/runs" -name summary.json 2>/dev/null | wc -l) runs finished"
  wait "$child" 2>/dev/null || true
done
(study killed)
without_wall() {
  awk -F, -v OFS=, '
    NR == 1 { for (i = 1; i <= NF; i++) if ($i == "wall_s") wall = i }
    { $wall = ""; print }
  ' "$1/table.csv"
}
diff <(without_wall "$out/whole") <(without_wall "$out/killed")
finished="$(grep -c ',finished,' "$out/killed/table.csv" || true)"
[ "$finished" = 65 ] || { echo "not all runs finished" >&2; exit 1; }
echo "identical tables: $(($(wc -l <"$out/whole/table.csv") - 1)) rows"
