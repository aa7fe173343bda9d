#!/usr/bin/env bash
# Format, lint, layering and some seconds of every fuzz target. Exits with 1 and the list of what is
# wrong.
#   scripts/check.sh [PRESET]     whose compile commands clang-tidy reads (default: dev)
set -euo pipefail
cd "$(dirname "$0")/.."
preset=${1:-dev}
scripts/setup.sh --with-checks
failed=0

mapfile -t sources < <(git ls-files '*.cpp' '*.hpp')
echo "check: format of ${#sources[@]} files"
clang-format --dry-run --Werror "${sources[@]}" || failed=1

echo "check: layering"
scripts/check_layering.sh || failed=1

# A configuration of its own, without precompiled headers: those of GCC are none to clang-tidy. The
# generated headers must exist before anything that includes them is looked at.
lint=build/lint-$preset
cmake --preset "$preset" -B "$lint" -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON >/dev/null
cmake --build "$lint" --target scanloc_generated >/dev/null
mapfile -t units < <(git ls-files '*.cpp' | grep -vE '^(tests|bench)/')
echo "check: lint of ${#units[@]} files"
scripts/lint.py "$lint" "${units[@]}" || failed=1

scripts/fuzz.sh 10 || failed=1

if [[ $failed -ne 0 ]]; then
  echo "check: failed" >&2
  exit 1
fi
echo "check: all well"
