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

forbid core 'scanloc/(mapdb|dataset|eval|proto|server|client)/|sqlite3|pcl/|grpc|google/|spdlog|thread|mutex|chrono|fstream|filesystem' \
  'core computes: no files, sockets, clock, threads, logging or other modules'
forbid mapdb 'scanloc/(dataset|eval|proto|server|client)/|pcl/|grpc|google/|spdlog' \
  'mapdb knows core only'
forbid dataset 'scanloc/(mapdb|eval|proto|server|client)/|sqlite3|grpc|google/|spdlog' \
  'dataset knows core only'
forbid eval 'scanloc/(mapdb|dataset|proto|server|client)/|sqlite3|pcl/|grpc|google/|spdlog' \
  'eval counts, measures and describes: it knows core only'
forbid proto 'scanloc/(mapdb|dataset|eval|server|client)/|sqlite3|pcl/' 'proto knows core only'
forbid server 'scanloc/(dataset|eval|client)/|sqlite3|pcl/' \
  'server knows core, mapdb and proto only'
forbid 'client/src client/include' 'scanloc/(mapdb|dataset|eval|server)/|sqlite3|pcl/' \
  'the client library knows core and proto only'
# Headers that hurt stay out of what others include.
forbid 'core/include mapdb/include dataset/include server/include client/include' 'sqlite3|pcl/|grpc|nanoflann|spdlog' \
  'heavy headers belong into .cpp files or src/'
exit $failed
