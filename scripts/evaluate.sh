#!/usr/bin/env bash
# Measures every method on simulated towns and, where there are any, on real drives; Markdown on
# stdout. Needs build/release/bin and python3; writes a few GB to a temporary folder.
#   scripts/evaluate.sh [LENGTH_M]      real drives: $SCANLOC_DATA, as docs/evaluation.md says
# $SCANLOC: another program than build/release/bin/scanloc. $TOWNS: seeds of the towns [1 2 3].
# $METHODS: names with commas between [all].
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh
scanloc=${SCANLOC:-$PWD/build/release/bin/scanloc}
length=${1:-600}
read -ra towns <<<"${TOWNS:-1 2 3}"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# shellcheck source=scripts/eval_sets.sh
source scripts/eval_sets.sh

methods=${METHODS:-auto,a-pc,a-pc:10,a-cc,a-cc:10,pc,cc,m2dp,segmatch}
declare -A results # of a set of queries: files with commas between
sets=()            # in order

# measure SET TITLE MAP ARGUMENTS...: prints the table, keeps the results.
measure() {
  local set=$1 title=$2 map=$3 file
  file=$(mktemp "$work/XXXXXX.json")
  shift 3
  "$scanloc" eval "$map" "$@" --method "$methods" --json --quiet >"$file"
  scripts/eval_tables.py full "$title" "$file"
  [[ -n "${results[$set]:-}" ]] || sets+=("$set")
  results[$set]=${results[$set]:+${results[$set]},}$file
}

for town in "${towns[@]}"; do
  drive=(--town-seed "$town" --length-m "$length")
  simulate "$work/map" "${drive[@]}" --session-seed 1
  simulate "$work/else" --town-seed 9"$town" --length-m 200 --spacing-m 5
  "$scanloc" build "$work/town.scanloc" --scans "$work/map" --poses "$work/map/poses.txt" --quiet \
    >/dev/null
  ask() { # SET: looks $work/query up
    measure "$1" "Town $town, $1" "$work/town.scanloc" --scans "$work/query" \
      --poses "$work/query/poses.txt" --negatives "$work/else" \
      --map-scans "$work/map" --map-poses "$work/map/poses.txt"
  }
  revisit() { # SET ARGUMENTS...
    simulate "$work/query" "${drive[@]}" --session-seed 2 --spacing-m 5 "${@:2}"
    ask "$1"
  }
  revisit "same direction"
  revisit "3.5 m to the side" --lane-shift-m 3.5
  revisit "reverse" --reverse
  revisit "reverse and 3.5 m to the side" --reverse --lane-shift-m 3.5
  simulate_mixed "$work/query" "${drive[@]}" --spacing-m 10
  ask "all four in one"
  revisit "tilt of ±5°" --tilt-deg 5
  revisit "32 rays" --rays 32
  revisit "290° field of view" --fov-deg 290
  rm -f "$work/town.scanloc"
done

data=${SCANLOC_DATA:-}
if [[ -n "$data" && -d "$data/nclt-2013-01-10" && -d "$data/kitti-00-first-827m" ]]; then
  nclt=$data/nclt-2013-01-10 kitti=$data/kitti-00-first-827m
  nclt_drive=(--scans "$nclt" --poses "$nclt/poses.txt")
  kitti_drive=(--scans "$kitti" --poses "$kitti/poses.txt")

  "$scanloc" build "$work/nclt.scanloc" "${nclt_drive[@]}" --to 467 --spacing-m 0 --quiet >/dev/null
  measure "NCLT, reverse revisits" "NCLT, reverse revisits, KITTI scans among the queries" \
    "$work/nclt.scanloc" "${nclt_drive[@]}" --from 468 --negatives "$kitti" \
    --map-scans "$nclt" --map-poses "$nclt/poses.txt"

  "$scanloc" build "$work/kitti.scanloc" "${kitti_drive[@]}" --every 2 --spacing-m 0 --quiet >/dev/null
  measure "KITTI 00, odd in even frames" \
    "KITTI 00, odd frames in the map of the even ones, NCLT scans among the queries" \
    "$work/kitti.scanloc" "${kitti_drive[@]}" --every 2 --offset 1 --negatives "$nclt" \
    --map-scans "$kitti" --map-poses "$kitti/poses.txt"

  "$scanloc" build "$work/own.scanloc" "${nclt_drive[@]}" --times "$nclt/times.txt" --spacing-m 0 \
    --quiet >/dev/null
  measure "NCLT within the session" "NCLT as a growing map, KITTI scans among the queries" \
    "$work/own.scanloc" "${nclt_drive[@]}" --times "$nclt/times.txt" --in-session \
    --query-spacing-m 1 --negatives "$kitti"
fi

printf '\nMeans over the towns.\n'
rows=()
for set in "${sets[@]}"; do rows+=("$set=${results[$set]}"); done
scripts/eval_tables.py summary r1,p100,f1 "${rows[@]}"
