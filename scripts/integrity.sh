#!/usr/bin/env bash
# Right, or silent: builds maps of made worlds and of real drives, with the defaults only, and asks
# where other scans were taken, from within and from elsewhere; a table as Markdown on stdout, and
# every false answer by the name of its scan. Needs build/release/bin and python3.
#   scripts/integrity.sh [--quick] [--sets NAME,NAME] [--seed N] [--out DIR]; --help tells more
# $SCANLOC: another program than build/release/bin/scanloc. $SCANLOC_DATA: the real drives, as
# docs/evaluation.md says; ../shared/data if not set.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/common.sh
export SCANLOC=${SCANLOC:-$PWD/build/release/bin/scanloc}
export SCANLOC_DATA=${SCANLOC_DATA:-$PWD/../shared/data}
[[ -x $SCANLOC ]] || { echo "integrity: no program $SCANLOC; build it, or set SCANLOC" >&2; exit 1; }
exec python3 scripts/integrity.py "$@"
