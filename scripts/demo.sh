#!/usr/bin/env bash
# Shows scanloc at work: maps a drive, serves the map, and asks the server where the scans of
# another drive were taken.
#
#   scripts/demo.sh                                  a made town: one session is mapped, another,
#                                                    in the opposite lane and direction, queries
#   scripts/demo.sh --scans DIR --poses FILE ...     your own drive: every second scan is mapped,
#                                                    the others query; further flags (--calib,
#                                                    --times, --format, --T-base-sensor) go to scanloc
#   scripts/demo.sh --bag FILE ...                   the same with your own bag (MCAP, rosbag2, ROS 1);
#                                                    further flags: --topic, --poses-from, --calib,
#                                                    --T-base-sensor
#
# The page of scanloc-web shows it live; on a terminal the demo waits with the end until Enter is pressed,
# ten minutes at most.
# Leaves map, answers, picture and the page as one file in demo-out/ (or $SCANLOC_DEMO_OUT).
set -euo pipefail
from=$PWD
path() { (cd "$from" && realpath -ms -- "$1"); }  # files are named from where the demo was called
cd "$(dirname "$0")/.."
. scripts/common.sh
root=$PWD
out=$(path "${SCANLOC_DEMO_OUT:-$root/demo-out}")

scripts/setup.sh --programs
configure release -DSCANLOC_BUILD_TESTS=OFF -DSCANLOC_BUILD_BENCH=OFF
cmake --build --preset release --target scanloc scanlocd scanloc-web
bin=$root/build/release/bin

rm -rf "$out"
mkdir -p "$out"

say() { printf '\n== %s\n' "$*"; }

if [[ $# -eq 0 ]]; then
  say "1. A made town: one session to map, and another to ask from"
  "$bin/scanloc" simulate "$out/mapping" --town-seed 7 --session-seed 1 --length-m 1500
  "$bin/scanloc" simulate "$out/wakeup" --town-seed 7 --session-seed 2 --length-m 1500 \
    --reverse --lane-shift-m 3.5 --spacing-m 60
  map_drive=(--scans "$out/mapping" --poses "$out/mapping/poses.txt" --times "$out/mapping/times.txt")
  query_drive=(--scans "$out/wakeup")
  truth=(--truth "$out/wakeup/poses.txt")
  build_flags=()
else
  say "1. Your drive: every second scan is mapped, the others ask"
  scans="" poses="" calib=() times=() format=() mount=() bag=() topics=()
  while [[ $# -gt 0 ]]; do
    case "$1" in
      --scans) scans=$(path "$2") ;;
      --poses) poses=$(path "$2") ;;
      --calib) calib=(--calib "$(path "$2")") ;;
      --times) times=(--times "$(path "$2")") ;;
      --format) format=(--format "$2") ;;
      --T-base-sensor) mount=(--T-base-sensor "$2") ;;
      --bag) bag+=(--bag "$(path "$2")") ;;
      --topic | --poses-from) topics+=("$1" "$2") ;;
      *) echo "demo: unknown flag $1; use --scans --poses --calib --times --format, or --bag" \
        "--topic --poses-from --calib, and --T-base-sensor" >&2; exit 2 ;;
    esac
    shift 2
  done
  build_flags=(--every 2 --spacing-m 0)
  if ((${#bag[@]} > 0)); then
    "$bin/scanloc" bag "${bag[1]}"
    map_drive=("${bag[@]}" "${topics[@]}" "${calib[@]}" "${mount[@]}")
    query_drive=("${map_drive[@]}" --every 2 --offset 1)
    truth=(--bag-truth)
  elif [[ -n "$scans" && -n "$poses" ]]; then
    map_drive=(--scans "$scans" --poses "$poses" "${calib[@]}" "${times[@]}" "${format[@]}" "${mount[@]}")
    query_drive=(--scans "$scans" --every 2 --offset 1 "${mount[@]}")
    truth=(--truth "$poses" "${calib[@]}" "${format[@]}")
  else
    echo "demo: --scans and --poses are both needed, or --bag" >&2
    exit 2
  fi
fi

say "2. Build the map"
"$bin/scanloc" build "$out/town.scanloc" "${map_drive[@]}" --session mapping "${build_flags[@]}"
"$bin/scanloc" info "$out/town.scanloc"

say "3. Serve it"
server_pid="" web_pid=""
trap 'for pid in $server_pid $web_pid; do kill "$pid" 2>/dev/null || true; done' EXIT
coproc SERVER { exec "$bin/scanlocd" --map "town=$out/town.scanloc" --listen 127.0.0.1:0 \
  --recent-answers 1000 2>"$out/server.log"; }
server_pid=$SERVER_PID
read -r -t 60 ready <&"${SERVER[0]}" || { cat "$out/server.log" >&2; exit 1; }
echo "$ready"
address=${ready##* }
exec {web}< <(exec "$bin/scanloc-web" --server "$address" --listen 127.0.0.1:0 2>"$out/web.log")
web_pid=$!
read -r -t 60 ready <&"$web" || { cat "$out/web.log" >&2; exit 1; }
echo "$ready"
page=${ready##* }

say "4. Ask the server, over the network, where each scan was taken"
"$bin/scanloc" locate --server "$address" --map town "${query_drive[@]}" "${truth[@]}" \
  --csv "$out/answers.csv" --quiet
"$bin/scanloc" locate --server "$address" --map town "${query_drive[@]}" "${truth[@]}"

say "5. Draw map and answers"
"$bin/scanloc" plot "$out/town.scanloc" --answers "$out/answers.csv" --out "$out/answers.svg"
if [[ "${truth[0]}" == --bag-truth ]]; then
  "$bin/scanloc" eval "$out/town.scanloc" "${query_drive[@]}" --report "$out/report"
fi

# Where npm's packages cannot be had, the build says so and leaves the page out.
has_page=''
[[ ! -e build/release/web/page/index.html ]] || has_page=yes
if [[ -n "$has_page" ]]; then
  "$bin/scanloc-web" --server "$address" --map town --snapshot "$out/town.html"
fi

say "6. Stop the server"
if [[ -n "$has_page" && -t 0 && -t 1 && -z "${CI:-}" ]]; then
  read -r -t 600 -p "Look at $page, then press Enter. " _ || echo
fi
kill -TERM "$web_pid" "$server_pid"
wait "$server_pid"
server_pid="" web_pid=""
echo "stopped"
printf '\nmap      %s\nanswers  %s\npicture  %s\n' \
  "$out/town.scanloc" "$out/answers.csv" "$out/answers.svg"
[[ -z "$has_page" ]] || echo "page     $out/town.html"
[[ ! -d "$out/report" ]] || echo "report   $out/report"
