#!/usr/bin/env bash
# Measures every method on simulated towns and, where there are any, on real drives; Markdown on
# stdout. Needs build/release/bin; writes a few GB to a temporary folder.
#   scripts/evaluate.sh [LENGTH_M]      real drives: $SCANLOC_DATA, as docs/evaluation.md says
set -euo pipefail
cd "$(dirname "$0")/.."
scanloc=$PWD/build/release/bin/scanloc
length=${1:-600}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

simulate() {
  rm -rf "$1"
  "$scanloc" simulate "$@" --quiet >/dev/null
}

# table TITLE MAP ARGUMENTS...: the table of `scanloc eval` in Markdown.
table() {
  local title=$1 map=$2
  shift 2
  printf '\n%s: ' "$title"
  "$scanloc" eval "$map" "$@" --quiet |
    awk 'NR == 1 { print; print ""; next }
         { gsub(/ m /, "_m "); gsub(/ deg /, "_deg "); printf "|"; for (i = 1; i <= NF; ++i) printf " %s |", $i; print "" }
         NR == 2 { printf "|"; for (i = 1; i <= NF; ++i) printf "---|"; print "" }'
}

methods=auto,a-pc,a-pc:10,a-cc,a-cc:10,pc,cc,m2dp
for town in 1 2 3; do
  drive=(--town-seed "$town" --length-m "$length")
  simulate "$work/map" "${drive[@]}" --session-seed 1
  simulate "$work/else" --town-seed 9"$town" --length-m 200 --spacing-m 5
  "$scanloc" build "$work/town.scanloc" --scans "$work/map" --poses "$work/map/poses.txt" --quiet \
    >/dev/null
  revisit() {
    local name=$1
    shift
    simulate "$work/query" "${drive[@]}" --session-seed 2 --spacing-m 5 "$@"
    table "Town $town, $name" "$work/town.scanloc" --scans "$work/query" \
      --poses "$work/query/poses.txt" --negatives "$work/else" --method "$methods" \
      --map-scans "$work/map" --map-poses "$work/map/poses.txt"
  }
  revisit "same direction"
  revisit "3.5 m to the side" --lane-shift-m 3.5
  revisit "reverse" --reverse
  revisit "reverse and 3.5 m to the side" --reverse --lane-shift-m 3.5
  revisit "tilt of ±5°" --tilt-deg 5
  revisit "32 rays" --rays 32
  revisit "290° field of view" --fov-deg 290
  rm -f "$work/town.scanloc"
done

data=${SCANLOC_DATA:-}
if [[ -n "$data" && -d "$data/nclt-2013-01-10" ]]; then
  nclt=(--scans "$data/nclt-2013-01-10" --poses "$data/nclt-2013-01-10/poses.txt")
  "$scanloc" build "$work/nclt.scanloc" "${nclt[@]}" --to 467 --spacing-m 0 --quiet >/dev/null
  table "NCLT, reverse revisits" "$work/nclt.scanloc" "${nclt[@]}" --from 468 \
    --negatives "$data/kitti-00-first-827m" --method "$methods" \
    --map-scans "$data/nclt-2013-01-10" --map-poses "$data/nclt-2013-01-10/poses.txt"
fi
