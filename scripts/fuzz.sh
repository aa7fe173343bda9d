#!/usr/bin/env bash
# Fuzzes what reads files and the network; fails at the first finding, whose input stays in
# build/fuzz/findings. Make it small (-minimize_crash=1) and put it into tests/fuzz/regressions.
#   scripts/fuzz.sh [SECONDS of each target (default 60)] [TARGET ...]
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh
seconds=${1:-60}
shift || true
targets=("$@")
[[ ${#targets[@]} -gt 0 ]] || targets=(scan poses bag map wire config http)

scripts/setup.sh --with-fuzz
configure fuzz
programs=(fuzz_make_seeds)
for target in "${targets[@]}"; do programs+=("fuzz_$target"); done
cmake --build --preset fuzz --target "${programs[@]}" >/dev/null
out=build/fuzz
find build/fuzz -name fuzz_make_seeds -type f -perm -u+x -exec {} "$out/seeds" \;
for target in "${targets[@]}"; do
  mkdir -p "$out/corpus/$target" "$out/findings/$target"
  dirs=("$out/corpus/$target" "$out/seeds/$target")
  [[ -d tests/fuzz/regressions/$target ]] && dirs+=("tests/fuzz/regressions/$target")
  echo "fuzz: $target for $seconds s"
  "$out/tests/fuzz/fuzz_$target" "${dirs[@]}" -max_total_time="$seconds" -timeout=10 \
    -rss_limit_mb=2048 -max_len=131072 -print_final_stats=1 \
    -artifact_prefix="$out/findings/$target/" >"$out/$target.log" 2>&1 || {
    tail -30 "$out/$target.log" >&2
    echo "fuzz: $target found something; its log is $out/$target.log" >&2
    exit 1
  }
  sed -n 's/^stat::number_of_executed_units: */fuzz: executions: /p' "$out/$target.log"
done
echo "fuzz: nothing found"
