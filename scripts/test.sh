#!/usr/bin/env bash
# Sets the machine up, builds and runs all tests.
#   scripts/test.sh [PRESET]      dev (default), release, asan or tsan
set -euo pipefail
cd "$(dirname "$0")/.."
preset=${1:-dev}

scripts/setup.sh
cmake --preset "$preset" -DSCANLOC_BUILD_TESTS=ON >/dev/null
cmake --build --preset "$preset"
ctest --preset "$preset" -j "$(nproc)"
