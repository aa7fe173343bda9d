#!/usr/bin/env bash
# Installs scanloc into an empty folder, builds the outside project against it, and runs it on a map
# and a server of it; then compares the documented example with the one that was built.
#   run.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build_dir=$2
work=$(mktemp -d)
server=
cleanup() {
  [[ -n "$server" ]] && kill "$server" 2>/dev/null && wait "$server" || true
  rm -rf "$work"
}
trap cleanup EXIT

cmake --install "$build_dir" --prefix "$work/prefix" >/dev/null
if grep -rlE '#include [<"](grpc|google/|sqlite3|pcl/|nanoflann|spdlog)' "$work/prefix/include" \
  --exclude-dir=pcl; then
  echo "an installed header includes one of a dependency that users need not have" >&2
  exit 1
fi
cmake -S "$source_dir/tests/package" -B "$work/build" -G Ninja -DCMAKE_PREFIX_PATH="$work/prefix" \
  -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build "$work/build" >/dev/null

# One that asks no server needs no gRPC; and the same by pkg-config.
cat >"$work/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.23)
project(offline LANGUAGES CXX)
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_DISABLE_FIND_PACKAGE_gRPC ON)
set(CMAKE_DISABLE_FIND_PACKAGE_Protobuf ON)
find_package(scanloc REQUIRED COMPONENTS core offline)
add_executable(offline "$source_dir/tests/package/where_am_i_offline.cpp")
target_link_libraries(offline scanloc::offline_client)
END
cmake -S "$work" -B "$work/offline" -G Ninja -DCMAKE_PREFIX_PATH="$work/prefix" >/dev/null
cmake --build "$work/offline" >/dev/null
if ldd "$work/offline/offline" | grep -E 'grpc|protobuf'; then
  echo "the component offline is linked to gRPC" >&2
  exit 1
fi
PKG_CONFIG_PATH=$(dirname "$(find "$work/prefix" -name scanloc-core.pc)")
export PKG_CONFIG_PATH
for of in core:close_loops offline:where_am_i_offline client:where_am_i; do
  # shellcheck disable=SC2046
  g++ -std=c++20 "$source_dir/tests/package/${of#*:}.cpp" -o "$work/by_pkg_config" \
    $(pkg-config --cflags --libs "scanloc-${of%:*}")
done

PATH=$work/prefix/bin:$PATH
"$source_dir/scripts/man_pages.sh" "$work/man" "$work/prefix/bin/scanloc" "$work/prefix/bin/scanlocd"
zgrep -q 'prior\\-heights' "$work/man/scanloc/scanloc-locate.1.gz"
zgrep -q 'tls\\-cert' "$work/man/scanlocd/scanlocd.1.gz"
test -s "$work/man/scanloc/scanloc-report-diff.1.gz"
# completes EXPECTED WORD...: what is offered for the last word.
completes() {
  local offered
  offered=$(
    . "$work/prefix/share/bash-completion/completions/scanloc"
    COMP_WORDS=("${@:2}") COMP_CWORD=$(($# - 2))
    _scanloc
    echo "${COMPREPLY[*]}"
  )
  [[ "$offered" == "$1" ]] || {
    echo "completion of ${*:2} offers: $offered" >&2
    exit 1
  }
}
completes "--prior --prior-geo --prior-heights --prior-session" scanloc locate --pri
completes report-diff scanloc report-
scanloc simulate "$work/drive" --town-seed 1 --session-seed 1 --length-m 30 --quiet >/dev/null
scanloc build "$work/town.scanloc" --scans "$work/drive" --poses "$work/drive/poses.txt" --quiet \
  >/dev/null
"$work/build/where_am_i_offline" "$work/town.scanloc" | grep insufficient_scan

mkfifo "$work/ready"
scanlocd --map "town=$work/town.scanloc" --listen 127.0.0.1:0 >"$work/ready" 2>/dev/null &
server=$!
read -r line <"$work/ready"
"$work/build/where_am_i" "${line##* }" | grep -E '^(localized|ambiguous|not_recognized|insufficient)'

"$work/build/close_loops" | grep '^scan 45 is at place 0$'

protoc --proto_path="$work/prefix/share/scanloc/proto" --python_out="$work" --grpc_out="$work" \
  --plugin=protoc-gen-grpc=/usr/bin/grpc_python_plugin scanloc/v1/map.proto \
  scanloc/v1/error_details.proto scanloc/v1/localization.proto
PYTHONPATH=$work /usr/bin/python3 "$source_dir/tests/package/where_am_i.py" "${line##* }" \
  "$work/drive/velodyne/000000.bin" | grep '^OUTCOME_LOCALIZED'

# The examples in the documentation are those that were just built.
documents() {
  sed -n "/^\`\`\`$3\$/,/^\`\`\`\$/p" "$source_dir/docs/$1" | sed '1d;$d' |
    diff - "$source_dir/tests/package/$2"
  if (($(wc -l <"$source_dir/tests/package/$2") > 20)); then
    echo "the example of $1 has more than 20 lines" >&2
    exit 1
  fi
}
documents client.md where_am_i.cpp cpp
documents client.md where_am_i.py python
documents loop_closure.md close_loops.cpp cpp
echo "package: all well"
