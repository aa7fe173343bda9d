#!/usr/bin/env bash
# Dependencies point one way (docs/architecture.md); exits with 1 and the lines that do not.
set -euo pipefail
cd "$(dirname "$0")/.."
failed=0

# forbid FILES PATTERN WHY: no file that git lists under FILES may include what matches PATTERN.
forbid() {
  local found
  found=$(git ls-files $1 | grep -E '\.(cpp|hpp)$' |
    xargs -r grep -nE "^#include +[<\"]($2)" || true)
  if [[ -n "$found" ]]; then
    printf 'layering: %s\n%s\n' "$3" "$found" >&2
    failed=1
  fi
}

forbid core 'scanloc/(mapdb|dataset|sim|eval|slam|proto|server|client)/|cli/|report/|sqlite3|pcl/|grpc|google/|spdlog|thread|mutex|chrono|fstream|filesystem' \
  'core computes: no files, sockets, clock, threads, logging or other modules'
forbid mapdb 'scanloc/(dataset|sim|eval|proto|server|client)/|pcl/|grpc|google/|spdlog' \
  'mapdb knows core and jobs only'
forbid catalogue 'scanloc/(mapdb|dataset|sim|eval|proto|server|client)/|sqlite3|pcl/|grpc|google/|spdlog' \
  'the catalogue knows names, sizes and hashes of maps: it knows core only'
forbid dataset 'scanloc/(mapdb|sim|eval|proto|server|client)/|pcl/|grpc|google/|spdlog' \
  'dataset knows core only'
# rosbag2 records into SQLite; what reads it stays in one file.
found=$(git ls-files dataset | grep -v '^dataset/src/bag/ros2_database.cpp$' |
  grep -E '\.(cpp|hpp)$' | xargs -r grep -nE '^#include +[<"]sqlite3' || true)
if [[ -n "$found" ]]; then
  printf 'layering: of dataset only ros2_database.cpp knows SQLite\n%s\n' "$found" >&2
  failed=1
fi
forbid eval 'scanloc/(mapdb|dataset|sim|report|proto|server|client)/|sqlite3|pcl/|grpc|google/|spdlog' \
  'eval counts, measures and describes: it knows core only'
forbid slam 'scanloc/(dataset|sim|eval|report|proto|server|client)/|cli/|sqlite3|pcl/|grpc|google/|spdlog' \
  'slam knows core, mapdb and jobs only'
forbid slam/include 'ceres/' 'Ceres stays in the sources of slam'
forbid geo 'scanloc/(mapdb|dataset|sim|eval|report|proto|server|client|slam|jobs)/' 'geo knows core only'
forbid jobs 'scanloc/(core|mapdb|dataset|sim|eval|report|proto|server|client|slam)/' 'jobs know no work'
forbid files 'scanloc/(mapdb|dataset|sim|eval|report|proto|server|client|slam|jobs)/' 'files knows core only'
forbid report 'scanloc/(mapdb|dataset|sim|proto|server|client)/|cli/|sqlite3|pcl/|grpc|google/|spdlog' \
  'report draws and writes: it knows core, eval and geo only'
forbid proto 'scanloc/(mapdb|dataset|sim|eval|server|client)/|sqlite3|pcl/' 'proto knows core only'
forbid server 'scanloc/(dataset|sim|eval|client)/|sqlite3|pcl/' \
  'server knows core, geo, mapdb and proto only'
forbid 'client/src client/include' 'scanloc/(mapdb|dataset|sim|eval|server)/|sqlite3|pcl/' \
  'the client library knows core and proto only'
forbid sim 'scanloc/(mapdb|eval|proto|server|client)/|sqlite3|pcl/|grpc|google/|spdlog' \
  'sim makes worlds and scans of them: it knows core, dataset and jobs only'
forbid ros2 'scanloc/(mapdb|sim|eval|report|server|proto/convert)|sqlite3|pcl/|grpc|google/' \
  'ros2 is thin, over the faces of client and dataset'
forbid web 'scanloc/(mapdb|sim|eval|server|proto/convert|proto/status)|sqlite3|pcl/|grpc|google/' \
  'web is thin, over the faces of client, dataset and report'
forbid 'core mapdb dataset sim eval report proto server client cli ros2 python' 'boost/' \
  'HTTP stays in web'
forbid 'core mapdb dataset sim eval report proto server client cli' 'dds/|ros2/|fastdds|fastrtps' \
  'DDS stays in ros2'
forbid python 'scanloc/(dataset|sim|report|proto/convert|server)|grpc|google/|sqlite3|pcl/' \
  'python binds core, mapdb, eval and client, and nothing below them'
# Rooms of core: each knows those before it.
forbid 'core/src/scan core/include/scanloc/core/scan' \
  '(scanloc/core/)?(map|scan_context|structural|track)/' 'scan knows no other room'
forbid 'core/src/map core/include/scanloc/core/map' '(scanloc/core/)?(scan_context|structural|track)/' \
  'map knows scan only'
forbid 'core/src/scan_context core/include/scanloc/core/scan_context' \
  '(scanloc/core/)?(structural|track)/' 'scan_context knows neither structural nor track'
forbid 'core/src/structural core/include/scanloc/core/structural' '(scanloc/core/)?track/' \
  'structural knows nothing of tracks'
# Headers that hurt stay out of what others include.
forbid 'core/include mapdb/include dataset/include eval/include report/include server/include client/include' 'sqlite3|pcl/|grpc|nanoflann|spdlog' \
  'heavy headers belong into .cpp files or src/'
exit $failed
