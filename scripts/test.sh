#!/usr/bin/env bash
# Sets the machine up, builds and runs all tests, or the test programs that are named.
#   scripts/test.sh [PRESET [PROGRAM ...]]      release (default: what the demo has built), dev, asan
#                                               or tsan
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh
preset=${1:-release}
programs=("${@:2}")

scripts/setup.sh
python=()  # a sanitizer's runtime is not Python's
if [[ ${#programs[@]} -eq 0 && $preset != asan && $preset != tsan ]]; then
  executable=$(python_for_package)
  python=(-DSCANLOC_BUILD_PYTHON=ON "-DPython_EXECUTABLE=$executable")
fi
configure "$preset" "${python[@]}"
if [[ ${#programs[@]} -eq 0 ]]; then
  cmake --build --preset "$preset"
  exec ctest --preset "$preset" -j "$(nproc)"
fi
cmake --build --preset "$preset" --target "${programs[@]}"
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
export TSAN_OPTIONS=ignore_noninstrumented_modules=1:halt_on_error=1:suppressions=$PWD/tests/tsan_suppressions.txt
for program in "${programs[@]}"; do
  "build/$preset/tests/$program" --gtest_brief=1
done
