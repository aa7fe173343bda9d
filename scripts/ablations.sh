#!/usr/bin/env bash
# The ablations of the paper's "Discussion", one command each; tables on stdout.
#   scripts/ablations.sh resolution|candidates|search|threshold|tilt|times|all
# resolution: rows and columns of the contexts (tab:abl_res). candidates: k (tab:topk). search: keys
# or brute force (tab:bf). threshold: what counts as right (tab:thres). tilt: roll and pitch of the
# queries (Sec. rollpitch). times: of each stage (tab:times).
#
# On a simulated town whose queries drive the other way in the next lane, or on a drive of your own:
#   MAP_SCANS=.. MAP_POSES=.. QUERY_SCANS=.. QUERY_POSES=.. NEGATIVES=.. scripts/ablations.sh all
# Arguments for `scanloc eval`, such as --from 468, in QUERY_ARGUMENTS; for `build`, such as --to 467,
# in MAP_ARGUMENTS. Needs build/release/bin.
set -euo pipefail
cd "$(dirname "$0")/.."
scanloc=$PWD/build/release/bin/scanloc
what=${1:-}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

if [[ -z "${MAP_SCANS:-}" ]]; then
  drive=(--town-seed 1 --length-m 800 --quiet)
  "$scanloc" simulate "$work/map" "${drive[@]}" --session-seed 1 >/dev/null
  "$scanloc" simulate "$work/query" "${drive[@]}" --session-seed 2 --reverse --lane-shift-m 3.5 \
    --spacing-m 4 >/dev/null
  "$scanloc" simulate "$work/else" --town-seed 91 --length-m 200 --spacing-m 5 --quiet >/dev/null
  MAP_SCANS=$work/map MAP_POSES=$work/map/poses.txt
  QUERY_SCANS=$work/query QUERY_POSES=$work/query/poses.txt NEGATIVES=$work/else
fi
read -ra map_arguments <<<"${MAP_ARGUMENTS:-}"
read -ra query_arguments <<<"${QUERY_ARGUMENTS:-}"

build() { # FILE PARAMETERS...
  local file=$1
  shift
  "$scanloc" build "$file" --scans "$MAP_SCANS" --poses "$MAP_POSES" --quiet \
    "${map_arguments[@]}" "$@" >/dev/null
}

evaluate() { # TITLE FILE ARGUMENTS...
  local title=$1 file=$2
  shift 2
  printf '\n%s\n' "$title"
  "$scanloc" eval "$file" --scans "$QUERY_SCANS" --poses "$QUERY_POSES" --quiet \
    ${NEGATIVES:+--negatives "$NEGATIVES"} "${query_arguments[@]}" "$@"
}

resolution() {
  for shape in "20 60 40 40" "40 60 80 40" "20 120 40 80" "40 120 80 80" "10 30 20 20"; do
    read -r rings sectors rows cols <<<"$shape"
    build "$work/shape.scanloc" --polar-rings "$rings" --polar-sectors "$sectors" \
      --cart-rows "$rows" --cart-cols "$cols" --cart-max-shift-cols $((cols / 4)) --no-calibrate
    evaluate "polar $rings x $sectors, cart $rows x $cols" "$work/shape.scanloc" \
      --method auto,a-pc,a-cc,pc,cc
    rm "$work/shape.scanloc"
  done
}
candidates() {
  evaluate "candidates k" "$work/map.scanloc" \
    --method a-pc:1,a-pc:10,a-pc:25,a-pc:50,a-cc:1,a-cc:10,a-cc:25,a-cc:50,auto:10,auto:30,auto
}
search() {
  evaluate "retrieval key or brute force, aligning key or all shifts" "$work/map.scanloc" \
    --method a-pc,a-pc-naive,a-pc-brute,a-cc,a-cc-naive,a-cc-brute --stage-times
}
threshold() {
  evaluate "right within" "$work/map.scanloc" --within-m 8,4,2,1 --method auto,a-pc,a-cc,pc,cc
}
tilt() {
  for degrees in 0 5 10 15; do
    evaluate "roll and pitch up to ±$degrees°" "$work/map.scanloc" --query-tilt-deg "$degrees" \
      --method auto,a-pc,a-cc,pc,cc,m2dp --map-scans "$MAP_SCANS" --map-poses "$MAP_POSES"
  done
}
times() {
  evaluate "times" "$work/map.scanloc" --method auto,a-pc,a-cc,pc,cc,m2dp --stage-times \
    --threads 1 --map-scans "$MAP_SCANS" --map-poses "$MAP_POSES"
}

case "$what" in
  resolution | candidates | search | threshold | tilt | times) chosen=("$what") ;;
  all) chosen=(resolution candidates search threshold tilt times) ;;
  *)
    sed -n '2,14s/^# \?//p' "$0" >&2
    exit 2
    ;;
esac
build "$work/map.scanloc"
for one in "${chosen[@]}"; do "$one"; done
