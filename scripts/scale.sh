#!/usr/bin/env bash
# How a map's cost grows with its places (docs/benchmarks.md, "As a map grows"): makes maps of a made
# road, measures each in a process of its own, and deletes them. Needs 14 kB of disk a place.
#   scripts/scale.sh [BUILD_DIR] [PLACES ...]
# The last is then served, 1,000 places are appended to it meanwhile, and the server reloads it.
#   KEYS='N ...'  measures retrieval alone with so many places (default: 100,000, 1 M and 10 M)
#   CHART=FILE    draws it all, too
#   MERGE=N ...   makes the last of N drives that are merged; their files need as much disk again,
#                 in SCANLOC_SCALE_PARTS_DIR (default: where the maps are)
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh
build=${1:-build/release}
shift || true
places=("${@:-1000}")
[[ $# -gt 0 ]] || places=(1000 10000 20000 100000 1000000)
folder=$(mktemp -d "${SCANLOC_SCALE_DIR:-/tmp}/scanloc-scale-XXXXXX")
parts=$(mktemp -d "${SCANLOC_SCALE_PARTS_DIR:-$folder}/parts-XXXXXX")
server=''
cleanup() {
  [[ -z "$server" ]] || kill "$server" 2>/dev/null || true
  wait || true
  rm -rf "$folder" "$parts"
}
trap cleanup EXIT
map=$folder/map.scanloc

# took WHAT COMMAND ...: runs it, and says what it took.
took() {
  /usr/bin/time -f "# $1: %e s, %U s of processor and %S s of kernel, at most %M KiB" "${@:2}"
}
# make COUNT: the map, at once or of drives.
make_map() {
  if [[ -z "${MERGE:-}" || "$1" != "${places[-1]}" ]]; then
    took "$1 places made" "$build/bench/make_map" --map "$map" --places "$1" 2>&1 | grep '^#' >&2
    return
  fi
  local each=$(($1 / MERGE))
  for ((i = 0; i < MERGE; ++i)); do
    "$build/bench/make_map" --map "$parts/$i.scanloc" --places "$each" --first "$((i * each))" \
      --session "drive-$i" 2>/dev/null
  done
  took "$MERGE drives merged" "$build/bin/scanloc" merge "$map" "$parts"/*.scanloc --quiet >/dev/null
  rm "$parts"/*
}
since() { awk -v start="$1" -v now="$(date +%s.%N)" 'BEGIN { printf "%.1f", now - start }'; }
memory() { awk -v field="$1:" '$1 == field { print $2 " KiB" }' "/proc/$server/status"; }
# served COUNT: waits until the log says that so many places are in service.
served() {
  grep -q "map map in service: $1 places" < <(tail -f -n +1 --pid="$server" "$folder/log") || {
    cat "$folder/log" >&2
    exit 1
  }
}

last=''
for count in "${places[@]}"; do
  rm -f "$map"
  make_map "$count"
  cat "$map" >/dev/null  # a warm page cache
  "$build/bench/scale_bench" "$map" | if [[ -z "$last" ]]; then cat; else tail -n 1; fi |
    tee -a "$folder/maps.csv"
  last=$count
done

start=$(date +%s.%N)
"$build/bin/scanlocd" --map "map=$map" --listen 127.0.0.1:0 --map-health-seconds 0 \
  >"$folder/out" 2>"$folder/log" &
server=$!
served "$last"
echo "# in service after $(since "$start") s, $(memory VmRSS)" >&2
took "1,000 places described and appended" "$build/bench/make_map" --map "$map" --append --places 1000 \
  --first "$last" --session more
start=$(date +%s.%N)
kill -HUP "$server"
served "$((last + 1000))"
echo "# loaded anew after $(since "$start") s, at most $(memory VmHWM), then $(memory VmRSS)" >&2
kill "$server"
wait "$server" || true
server=''

echo "# retrieval alone, keys like those of the last map" >&2
last=''
for count in ${KEYS:-100000 1000000 10000000}; do
  "$build/bench/scale_bench" "$map" --keys "$count" --num-queries 50 |
    if [[ -z "$last" ]]; then cat; else tail -n 1; fi | tee -a "$folder/keys.csv"
  last=$count
done
[[ -z "${CHART:-}" ]] || "$build/bench/scale_chart" "$folder/maps.csv" "$folder/keys.csv" >"$CHART"
