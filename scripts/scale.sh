#!/usr/bin/env bash
# How a map's cost grows with its places (docs/benchmarks.md, "As a map grows"): makes maps of a made
# road, measures each in a process of its own, and deletes them. Needs 8 kB of disk a place.
#   scripts/scale.sh [BUILD_DIR] [PLACES ...]
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh
build=${1:-build/release}
shift || true
places=("${@:-1000}")
[[ $# -gt 0 ]] || places=(1000 10000 20000 100000 1000000)
folder=$(mktemp -d "${SCANLOC_SCALE_DIR:-/tmp}/scanloc-scale-XXXXXX")
trap 'rm -rf "$folder"' EXIT

last=''
for count in "${places[@]}"; do
  map=$folder/map.scanloc
  rm -f "$map"
  start=$(date +%s)
  "$build/bench/make_map" --map "$map" --places "$count" 2>/dev/null
  echo "# $count places made in $(($(date +%s) - start)) s" >&2
  cat "$map" >/dev/null  # a warm page cache
  "$build/bench/scale_bench" "$map" | if [[ -z "$last" ]]; then cat; else tail -n 1; fi
  last=$count
done
echo "# retrieval alone, keys like those of the last map" >&2
"$build/bench/scale_bench" "$map" --keys 10000000
