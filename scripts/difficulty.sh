#!/usr/bin/env bash
# How hard the simulated towns are for the paper's methods: recall@1 within 8 m by kind of revisit,
# as a Markdown table on stdout. Needs build/release/bin; writes a few GB to a temporary folder.
#   scripts/difficulty.sh [TOWN_SEED] [LENGTH_M]
set -euo pipefail
cd "$(dirname "$0")/.."
scanloc=$PWD/build/release/bin/scanloc
town=${1:-1}
length=${2:-2000}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

simulate() {
  "$scanloc" simulate "$@" --quiet --town-seed "$town" --length-m "$length" >/dev/null
}

simulate "$work/map" --session-seed 1
"$scanloc" build "$work/town.scanloc" --scans "$work/map" --poses "$work/map/poses.txt" --quiet \
  >/dev/null
echo "Town seed $town, $length m; map: session 1; queries: session 2, every 6 m; correct within 8 m."
echo
echo "| revisit | pc k=1 | cc k=1 | a-pc k=1 | a-cc k=1 | pc k=10 | cc k=10 | a-pc k=10 | a-cc k=10 | auto |"
echo "|---|---|---|---|---|---|---|---|---|---|"
row() {
  local name=$1
  shift
  rm -rf "$work/query"
  simulate "$work/query" --session-seed 2 --spacing-m 6 "$@"
  printf '| %s ' "$name"
  for how in "pc 1" "cc 1" "a-pc 1" "a-cc 1" "pc 10" "cc 10" "a-pc 10" "a-cc 10" "auto 300"; do
    read -r method k <<<"$how"
    "$scanloc" locate "$work/town.scanloc" --scans "$work/query" --method "$method" \
      --candidates "$k" --truth "$work/query/poses.txt" --csv "$work/answers.csv" --quiet \
      2>/dev/null >/dev/null
    awk -F, 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i == "true_place_error_m") column = i }
             NR > 1 { ++n; if ($column != "" && $column < 8) ++right }
             END { printf "| %.2f ", right / n }' "$work/answers.csv"
  done
  echo "|"
}
row "same direction"
row "lane shift 2 m" --lane-shift-m 2
row "lane shift 3.5 m" --lane-shift-m 3.5
row "lane shift 7 m" --lane-shift-m 7
row "reverse" --reverse
row "reverse + 3.5 m" --reverse --lane-shift-m 3.5
row "reverse + 7 m" --reverse --lane-shift-m 7
