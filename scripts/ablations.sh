#!/usr/bin/env bash
# The ablations of the paper's "Discussion", one command each; Markdown on stdout.
#   scripts/ablations.sh resolution|candidates|search|threshold|tilt|times|trees|check|all
# resolution: rows and columns of the contexts (tab:abl_res). candidates: k (tab:topk). search: keys
# or brute force (tab:bf). threshold: what counts as right (tab:thres). tilt: roll and pitch of the
# queries (Sec. rollpitch). times: of each stage (tab:times). trees: one k-d tree for all variants
# of the places or one for each (Sec. V-D). check: with and without the comparison of the full
# descriptors ("Full descriptor's effect"). P, R, D: precision, recall and KL divergence at the
# greatest F1.
#
# On a simulated town with revisits of all four kinds among the queries, or on a drive of your own:
#   MAP_SCANS=.. MAP_POSES=.. QUERY_SCANS=.. QUERY_POSES=.. NEGATIVES=.. scripts/ablations.sh all
# Arguments for `scanloc eval`, such as --from 468, in QUERY_ARGUMENTS; for `build`, such as --to 467,
# in MAP_ARGUMENTS. Needs build/release/bin, or another program as $SCANLOC, and python3. The town's
# length: $LENGTH_M [800].
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh
scanloc=${SCANLOC:-$PWD/build/release/bin/scanloc}
what=${1:-}
case "$what" in
  resolution | candidates | search | threshold | tilt | times | trees | check) chosen=("$what") ;;
  all) chosen=(resolution candidates search threshold tilt times trees check) ;;
  *)
    sed -n '2,16s/^# \?//p' "$0" >&2
    exit 2
    ;;
esac
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# shellcheck source=scripts/eval_sets.sh
source scripts/eval_sets.sh

if [[ -z "${MAP_SCANS:-}" ]]; then
  drive=(--town-seed 1 --length-m "${LENGTH_M:-800}")
  simulate "$work/map" "${drive[@]}" --session-seed 1
  simulate_mixed "$work/query" "${drive[@]}" --spacing-m 8
  simulate "$work/else" --town-seed 91 --length-m 300 --spacing-m 3
  MAP_SCANS=$work/map MAP_POSES=$work/map/poses.txt
  QUERY_SCANS=$work/query QUERY_POSES=$work/query/poses.txt NEGATIVES=$work/else
fi
read -ra map_arguments <<<"${MAP_ARGUMENTS:-}"
read -ra query_arguments <<<"${QUERY_ARGUMENTS:-}"
map_scans=(--map-scans "$MAP_SCANS" --map-poses "$MAP_POSES") # for m2dp

build() { # FILE PARAMETERS...
  local file=$1
  shift
  rm -f "$file"
  "$scanloc" build "$file" --scans "$MAP_SCANS" --poses "$MAP_POSES" --quiet \
    "${map_arguments[@]}" "$@" >/dev/null
}

# evaluate RESULTS MAP ARGUMENTS...
evaluate() {
  local results=$1 map=$2
  shift 2
  "$scanloc" eval "$map" --scans "$QUERY_SCANS" --poses "$QUERY_POSES" --quiet --json \
    ${NEGATIVES:+--negatives "$NEGATIVES"} "${query_arguments[@]}" "$@" >"$results"
}

heading() { printf '\n### %s\n' "$1"; }

resolution() {
  local shape rows cols rings sectors marked polar=() cart=()
  local polar_shapes=("10 30" "20 60" "20 120" "40 60" "40 120" "60 180")
  local cart_shapes=("40 20" "40 40" "40 60" "60 40" "80 80" "120 120")
  for i in "${!polar_shapes[@]}"; do
    read -r rings sectors <<<"${polar_shapes[$i]}"
    read -r rows cols <<<"${cart_shapes[$i]}"
    # Lateral shifts of up to 20 m, whatever the width of a column.
    build "$work/shape.scanloc" --polar-rings "$rings" --polar-sectors "$sectors" \
      --cart-rows "$rows" --cart-cols "$cols" --cart-max-shift-cols $((cols / 4)) --no-calibrate
    shape=$work/shape-$i
    evaluate "$shape-polar.json" "$work/shape.scanloc" --method pc,a-pc,auto
    evaluate "$shape-cart.json" "$work/shape.scanloc" --method cc,a-cc
    marked=""
    [[ $i -eq 1 ]] && marked="\\*"
    polar+=("$rings × $sectors$marked=$shape-polar.json")
    cart+=("$rows × $cols$marked=$shape-cart.json")
  done
  heading "Descriptor resolution, polar context (\\*: default)"
  scripts/eval_tables.py groups p,r,d,r1 "${polar[@]}"
  heading "Descriptor resolution, cart context (\\*: default)"
  scripts/eval_tables.py groups p,r,d,r1 "${cart[@]}"
}
candidates() {
  local methods="" name k
  for k in 1 10 25 50 100; do
    for name in pc a-pc cc a-cc auto; do methods+=,$name:$k; done
  done
  evaluate "$work/candidates.json" "$work/map.scanloc" --method "${methods#,}"
  heading "Candidates k"
  scripts/eval_tables.py candidates p,r,d,r1 "$work/candidates.json"
}
search() {
  local methods="" name
  for name in pc a-pc cc a-cc; do methods+=,$name,$name-naive,$name-brute; done
  evaluate "$work/search.json" "$work/map.scanloc" --method "${methods#,}"
  heading "Retrieval key or every place (-brute); aligning key or all shifts (-naive)"
  scripts/eval_tables.py methods auc,f1,r1,p100 "$work/search.json"
}
threshold() {
  evaluate "$work/threshold.json" "$work/map.scanloc" --within-m 8,4,2,1 \
    --method auto,a-pc,a-cc,pc,cc
  heading "What counts as right"
  scripts/eval_tables.py within auc,r1 "$work/threshold.json"
}
tilt() {
  local degrees rows=()
  for degrees in 0 5 10 15; do
    evaluate "$work/tilt-$degrees.json" "$work/map.scanloc" --query-tilt-deg "$degrees" \
      --method auto,a-pc,a-cc,pc,cc,m2dp "${map_scans[@]}"
    rows+=("±$degrees°=$work/tilt-$degrees.json")
  done
  heading "Roll and pitch of the queries"
  scripts/eval_tables.py groups auc,r1 "${rows[@]}"
}
times() {
  evaluate "$work/times.json" "$work/map.scanloc" --method pc,a-pc,cc,a-cc,m2dp,auto \
    --stage-times --threads 1 "${map_scans[@]}"
  heading "Time, one thread"
  scripts/eval_tables.py times "$work/times.json"
}
trees() {
  evaluate "$work/trees.json" "$work/map.scanloc" --method \
    a-pc:1,a-pc:3,a-pc-trees:1,a-pc:10,a-pc:30,a-pc-trees:10,a-cc:1,a-cc:2,a-cc-trees:1,a-cc:10,a-cc:20,a-cc-trees:10
  heading "One tree or one for each variant"
  scripts/eval_tables.py methods auc,f1,p,r,d,r1,p100 "$work/trees.json"
}
check() {
  evaluate "$work/check.json" "$work/map.scanloc" \
    --method pc,pc-key,cc,cc-key,a-pc,a-pc-key,a-cc,a-cc-key
  heading "With and without (-key) the check of the full descriptors"
  scripts/eval_tables.py methods auc,f1,p,r,d,r1,p100 "$work/check.json"
}

build "$work/map.scanloc"
for one in "${chosen[@]}"; do "$one"; done
