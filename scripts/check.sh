#!/usr/bin/env bash
# Format and layering; exits with 1 and the list of what is wrong.
#   scripts/check.sh --fuzz       runs every fuzz target for some seconds, too
#   scripts/check.sh --lint       lints, too, what differs from the newest commit a day older than HEAD
#   scripts/check.sh --lint-all   lints everything
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh
scripts/setup.sh --with-checks
failed=0

mapfile -t sources < <(git ls-files '*.cpp' '*.hpp')
echo "check: format of ${#sources[@]} files"
clang-format --dry-run --Werror "${sources[@]}" || failed=1

echo "check: layering"
scripts/check_layering.sh || failed=1

lint() {
  # A configuration of its own, without precompiled headers: those of GCC are none to clang-tidy. The
  # generated headers must exist before anything that includes them is looked at.
  configure dev -B build/lint -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON
  cmake --build build/lint --target scanloc_generated >/dev/null
  # Boost's coroutines are none to clang-tidy 14; nanobind is there only while a wheel is made.
  mapfile -t all < <(git ls-files '*.cpp' | grep -vE '^(tests|bench|python)/|^web/src/http_se')
  day_ago=$(($(git log -1 --format=%ct) - 86400))
  since=$(git rev-list -1 --before="@$day_ago" HEAD)
  if [[ "$1" == --lint-all || -z "$since" ]]; then
    units=("${all[@]}")
  else
    # A header is looked at through the first source that includes it.
    mapfile -t units < <(git diff --name-only --diff-filter=d "$since" -- '*.cpp' '*.hpp' |
      grep -vE '^(tests|bench|python)/|^web/src/http_se' | while read -r file; do
        case "$file" in
          *.cpp) echo "$file" ;;
          *) grep -lE "#include [<\"](.*/)?$(basename "$file")" "${all[@]}" | head -1 ;;
        esac
      done | sort -u)
  fi
  echo "check: lint of ${#units[@]} files of ${#all[@]}"
  printf '%s\0' "${units[@]}" |
    xargs -0 -r -n 1 -P "$(nproc)" clang-tidy --quiet -p build/lint 2>/dev/null || failed=1
}
if [[ "${1:-}" == --lint* ]]; then lint "$1"; fi

if [[ "${1:-}" == --fuzz ]]; then scripts/fuzz.sh 10 || failed=1; fi

if [[ $failed -ne 0 ]]; then
  echo "check: failed" >&2
  exit 1
fi
echo "check: all well"
