#!/usr/bin/env bash
# The load that scanlocd carries, beside a bare gRPC echo of the same message sizes in the same run;
# Markdown tables on stdout at the end. Load generator and servers share the machine. Needs
# build/release. Exits with 1 if a soak finds that memory, threads or descriptors grow.
#   scripts/load.sh [SECONDS]          of each measurement (default 5)
#   SOAK_MINUTES=30 scripts/load.sh    then half of the greatest load for so long: descriptors, auto,
#                                      scans and streams mixed, all maps loaded anew every minute
#   OVERLOAD_SECONDS=60 ...            twice the greatest load for so long (default: SECONDS)
#   SCANLOC_LOAD_DIR=DIR ...           keeps map, requests and logs there for the next run
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh
seconds=${1:-5}
bench=$PWD/build/release/bench/load_bench
work=${SCANLOC_LOAD_DIR:-$(mktemp -d)}
soak_minute_s=${SOAK_MINUTE_SECONDS:-60}  # shorter ones try the script itself
pids=()
cleanup() {
  for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
  wait || true
  [[ -n "${SCANLOC_LOAD_DIR:-}" ]] || rm -rf "$work"
}
trap cleanup EXIT
mkdir -p "$work"
[[ -f "$work/scans" ]] || "$bench" prepare "$work"

# start NAME COMMAND...: sets $address to where it listens.
start() {
  local name=$1
  shift
  rm -f "$work/$name"
  mkfifo "$work/$name"
  "$@" >"$work/$name" 2>"$work/$name.log" &
  pids+=($!)
  read -r line <"$work/$name"
  address=${line##* }
}
# field JSON A.B: the number there, or 0.
field() { python3 -c 'import json,sys; d=json.loads(sys.argv[1])
for k in sys.argv[2].split("."): d=d.get(k,{}) if isinstance(d,dict) else {}
print(round(d,3) if isinstance(d,(int,float)) else 0)' "$1" "$2"; }
calc() { python3 -c "print($1)"; }
metric() { curl -s "http://$metrics/metrics" | awk -v name="$1" '$1 == name { printf "%d", $2 }'; }
memory_mib() { echo $(($(metric process_resident_memory_bytes) / 1048576)); }
# best RUN_ARGUMENTS...: requests answered a second at most.
best_of() { field "$("$bench" run "$@" --seconds "$seconds")" OK.per_s; }
# row CELL...: a line of a Markdown table.
row() { printf '|'; printf ' %s |' "$@"; printf '\n'; }

start scanlocd build/release/bin/scanlocd --map "bench=$work/map.scanloc" --listen 127.0.0.1:0 \
  --metrics-listen 127.0.0.1:0 --log-requests none
server=$address
server_pid=${pids[-1]}
metrics=$(sed -n 's|.*metrics on http://\([^/]*\)/.*|\1|p' "$work/scanlocd.log")

table=$(row queries echo scanlocd share "half load: p50, p99" "echo: p50, p99"; row --- --- --- --- --- ---)
for kind in descriptors scans descriptors_auto; do
  echo "load: $kind" >&2
  probe=$("$bench" run "$server" --requests "$work/$kind" --seconds 1)
  start echo "$bench" echo --response-bytes "$(field "$probe" response_bytes)"
  echo_pid=${pids[-1]}
  echo_address=$address
  # In turns, so that both see the machine alike; the better of two each.
  best_echo=0 best=0
  for _ in 1 2; do
    best_echo=$(calc "max($best_echo, $(best_of "$echo_address" --requests "$work/$kind"))")
    best=$(calc "max($best, $(best_of "$server" --requests "$work/$kind"))")
  done
  half=$(calc "$best / 2")
  calm=$("$bench" run "$server" --requests "$work/$kind" --seconds "$seconds" --rate "$half")
  calm_echo=$("$bench" run "$echo_address" --requests "$work/$kind" --seconds "$seconds" --rate "$half")
  kill "$echo_pid" && wait "$echo_pid" || true
  table+=$'\n'$(row "$kind" "$(calc "round($best_echo)") /s" "$(calc "round($best)") /s" \
    "$(calc "round(100 * $best / $best_echo)") %" \
    "$(field "$calm" OK.p50_ms), $(field "$calm" OK.p99_ms) ms" \
    "$(field "$calm_echo" OK.p50_ms), $(field "$calm_echo" OK.p99_ms) ms")
  [[ $kind == descriptors_auto ]] && max_auto=$best
done

echo "load: twice the greatest load of auto" >&2
memory_before=$(memory_mib)
# Many connections from this machine are one client; what counts is the whole.
"$bench" run "$server" --requests "$work/descriptors_auto" --seconds "${OVERLOAD_SECONDS:-$seconds}" \
  --rate "$(calc "2 * $max_auto")" >"$work/over.json" &
over_pid=$!
memory_highest=$memory_before
while kill -0 "$over_pid" 2>/dev/null; do
  now=$(memory_mib)
  ((now > memory_highest)) && memory_highest=$now
  sleep 0.5
done
wait "$over_pid"
over=$(<"$work/over.json")
after=$("$bench" run "$server" --requests "$work/descriptors_auto" --seconds "$seconds" \
  --rate "$(calc "$max_auto / 2")")
overload=$(
  row "auto, twice what it carries" value
  row --- ---
  row "asked for, ${OVERLOAD_SECONDS:-$seconds} s" "$(calc "round(2 * $max_auto)") /s"
  row accepted "$(field "$over" OK.per_s) /s, p50 $(field "$over" OK.p50_ms), p99 $(field "$over" OK.p99_ms) ms"
  row refused "$(field "$over" RESOURCE_EXHAUSTED.per_s) /s, p99 $(field "$over" RESOURCE_EXHAUSTED.p99_ms) ms"
  row "refused without a time to come back" "$(field "$over" refused_without_retry_after)"
  row "ended otherwise" "$(calc "$(field "$over" count) - $(field "$over" OK.count) - $(field "$over" RESOURCE_EXHAUSTED.count)")"
  row "memory before, at most, after" "$memory_before, $memory_highest, $(memory_mib) MiB"
  row "then half load" "$(field "$after" OK.per_s) /s, p99 $(field "$after" OK.p99_ms) ms, refused $(field "$after" RESOURCE_EXHAUSTED.count)"
)

grown=""
if [[ -n "${SOAK_MINUTES:-}" ]]; then
  # Of each ten requests eight descriptors, one scan, one auto.
  mix=()
  for kind in descriptors descriptors descriptors descriptors scans \
    descriptors descriptors descriptors descriptors descriptors_auto; do
    mix+=(--requests "$work/$kind")
  done
  rate=$(calc "$(best_of "$server" "${mix[@]}") / 2")
  echo "load: soak at $rate /s for $SOAK_MINUTES min" >&2
  soak=$(row minute answered refused "other ends" p99 "answers on streams" memory threads descriptors
    row --- --- --- --- --- --- --- --- ---)
  base_memory=0 base_threads=0 base_fds=0
  for ((minute = 1; minute <= SOAK_MINUTES; ++minute)); do
    kill -HUP "$server_pid"
    result=$("$bench" run "$server" "${mix[@]}" --seconds "$soak_minute_s" --rate "$rate" \
      --streams 8 --stream-rate 1)
    memory=$(memory_mib) threads=$(metric process_threads) fds=$(metric process_open_fds)
    ok=$(field "$result" OK.count) refused=$(field "$result" RESOURCE_EXHAUSTED.count)
    soak+=$'\n'$(row "$minute" "$ok" "$refused" "$(calc "$(field "$result" count) - $ok - $refused")" \
      "$(field "$result" OK.p99_ms) ms" "$(field "$result" stream_answers)" "$memory MiB" "$threads" "$fds")
    if ((minute <= 2)); then
      # What it needs is only known once it has loaded its maps anew.
      ((memory > base_memory)) && base_memory=$memory
      ((threads > base_threads)) && base_threads=$threads
      ((fds > base_fds)) && base_fds=$fds
    fi
  done
  # gRPC keeps some threads and connections for a while.
  ((memory > base_memory * 11 / 10 + 32)) && grown+="memory from $base_memory to $memory MiB; "
  ((threads > base_threads + 8)) && grown+="threads from $base_threads to $threads; "
  ((fds > base_fds + 8)) && grown+="descriptors from $base_fds to $fds; "
fi

printf '%s\n\n%s\n' "$table" "$overload"
[[ -z "${soak:-}" ]] || printf '\n%s\n' "$soak"
if [[ -n "$grown" ]]; then
  echo "load: in the soak grew ${grown%; }" >&2
  exit 1
fi
