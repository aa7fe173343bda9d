#!/usr/bin/env bash
# The load that scanlocd carries, beside a bare gRPC echo of the same message sizes in the same run;
# a table on stdout. Load generator and servers share the machine. Needs build/release.
#   scripts/load.sh [SECONDS]          of each measurement (default 5)
#   SOAK_MINUTES=30 scripts/load.sh    then half of the greatest load for so long
#   OVERLOAD_SECONDS=60 ...            twice the greatest load for so long (default: SECONDS)
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:-5}
bench=$PWD/build/release/bench/load_bench
work=${SCANLOC_LOAD_DIR:-$(mktemp -d)}
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
field() { python3 -c 'import json,sys; d=json.loads(sys.argv[1])
for k in sys.argv[2].split("."): d=d.get(k,{}) if isinstance(d,dict) else {}
print(round(d,3) if isinstance(d,(int,float)) else 0)' "$1" "$2"; }
metric() { curl -s "http://$metrics/metrics" | awk -v name="$1" '$1 == name { printf "%d", $2 }'; }
process() { echo "memory $(($(metric process_resident_memory_bytes) / 1048576)) MiB," \
  "$(metric process_threads) threads, $(metric process_open_fds) descriptors"; }

start scanlocd build/release/bin/scanlocd --map "bench=$work/map.scanloc" --listen 127.0.0.1:0 \
  --metrics-listen 127.0.0.1:0 --log-requests none
server=$address
metrics=$(sed -n 's|.*metrics on http://\([^/]*\)/.*|\1|p' "$work/scanlocd.log")

for kind in descriptors scans descriptors_auto; do
  probe=$("$bench" run "$server" --requests "$work/$kind" --seconds 1)
  start echo "$bench" echo --response-bytes "$(field "$probe" response_bytes)"
  echo_pid=${pids[-1]}
  echo_address=$address
  # In turns, so that both see the machine alike; the better of two each.
  best_echo=0 best=0
  for _ in 1 2; do
    result=$("$bench" run "$echo_address" --requests "$work/$kind" --seconds "$seconds")
    best_echo=$(python3 -c "print(max($best_echo, $(field "$result" OK.per_s)))")
    result=$("$bench" run "$server" --requests "$work/$kind" --seconds "$seconds")
    best=$(python3 -c "print(max($best, $(field "$result" OK.per_s)))")
  done
  half=$(python3 -c "print($best / 2)")
  calm=$("$bench" run "$server" --requests "$work/$kind" --seconds "$seconds" --rate "$half")
  calm_echo=$("$bench" run "$echo_address" --requests "$work/$kind" --seconds "$seconds" --rate "$half")
  kill "$echo_pid" && wait "$echo_pid" || true
  python3 -c "print('%s: echo %.0f/s, scanlocd %.0f/s = %.0f %%; at half of that p50 %s ms, p99 %s ms (echo %s, %s)' % (
    '$kind', $best_echo, $best, 100 * $best / $best_echo,
    '$(field "$calm" OK.p50_ms)', '$(field "$calm" OK.p99_ms)',
    '$(field "$calm_echo" OK.p50_ms)', '$(field "$calm_echo" OK.p99_ms)'))"
  [[ $kind == descriptors_auto ]] && max_auto=$best
done

echo "before overload: $(process)"
# Many connections from this machine are one client; what counts is the whole.
double=$(python3 -c "print(2 * $max_auto)")
over=$("$bench" run "$server" --requests "$work/descriptors_auto" --seconds "${OVERLOAD_SECONDS:-$seconds}" \
  --rate "$double")
echo "twice the greatest load of auto: accepted $(field "$over" OK.per_s)/s p99 $(field "$over" OK.p99_ms) ms," \
  "refused $(field "$over" RESOURCE_EXHAUSTED.per_s)/s p99 $(field "$over" RESOURCE_EXHAUSTED.p99_ms) ms"
echo "during and after: $(process)"
after=$("$bench" run "$server" --requests "$work/descriptors_auto" --seconds "$seconds" \
  --rate "$(python3 -c "print($max_auto / 2)")")
echo "recovered, half load: $(field "$after" OK.per_s)/s p99 $(field "$after" OK.p99_ms) ms," \
  "refused $(field "$after" RESOURCE_EXHAUSTED.count)"

if [[ -n "${SOAK_MINUTES:-}" ]]; then
  echo "soak begins: $(process)"
  for ((minute = 5; minute <= SOAK_MINUTES; minute += 5)); do
    result=$("$bench" run "$server" --requests "$work/descriptors" --seconds 300 --rate 500)
    echo "after $minute min: $(field "$result" OK.count) answered, p99 $(field "$result" OK.p99_ms) ms, $(process)"
  done
fi
