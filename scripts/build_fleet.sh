#!/usr/bin/env bash
# Builds a map of each drive, many at once, and merges them: one job a drive, by GNU parallel on this
# machine, or by Slurm as a job array and a merge that waits for all of it. What is done already is
# not done again: run it again after a failure, or with further drives in the folder.
set -euo pipefail

usage() {
  cat <<'TEXT'
scripts/build_fleet.sh OUT DRIVES [--jobs N] [--slurm] [--parts DIR] [-- BUILD_OPTIONS ...]

  OUT      map file to make
  DRIVES   folder of folders, one a drive: scans in it (or in velodyne/), poses.txt beside
  --jobs   drives at once on this machine (default: one a core); with Slurm, at once in all
  --slurm  submit to Slurm (sbatch) and wait for the merge; DRIVES and OUT must be on a disk that
           all machines see
  --parts  folder for the maps of the drives (default: OUT.parts); kept
  --       what follows goes to scanloc build, for example --sensor-height-m 1.8

All drives must be in one map frame. $SCANLOC names the program if it is not in the PATH.
TEXT
}

die() { echo "build_fleet: $*" >&2; exit "${2:-1}"; }

# build_one PART DRIVE [OPTION ...]: one core a drive; calibration is of the merged map.
build_one() {
  local part=$1 drive=$2
  shift 2
  [[ -e "$part" ]] && return
  "$SCANLOC" build "$part.building" --scans "$drive" --poses "$drive/poses.txt" \
    --session "$(basename "$drive")" --resume --threads 1 --no-calibrate --quiet "$@"
  mv "$part.building" "$part"
}

merge_all() {
  local out=$1
  shift
  rm -f "$out.merged"
  "$SCANLOC" merge "$out.merged" "$@" --quiet
  mv "$out.merged" "$out"  # in one step: whoever serves it has the old or the new one
}

export SCANLOC=${SCANLOC:-scanloc}
case "${1:-}" in
  --build-nth)  # of Slurm: --build-nth LIST [OPTION ...]
    IFS=$'\t' read -r part drive < <(sed -n "$((SLURM_ARRAY_TASK_ID + 1))p" "$2")
    build_one "$part" "$drive" "${@:3}"
    exit ;;
  --build) build_one "${@:2}"; exit ;;
  --merge-and-say) merge_all "${@:3}"; touch "$2"; exit ;;
  -h | --help) usage; exit ;;
esac

out='' drives='' jobs='' slurm='' parts=''
options=()
while [[ $# -gt 0 ]]; do
  case $1 in
    --jobs) jobs=$2; shift 2 ;;
    --parts) parts=$2; shift 2 ;;
    --slurm) slurm=1; shift ;;
    --) options=("${@:2}"); break ;;
    -*) usage >&2; exit 2 ;;
    *)
      if [[ -z "$out" ]]; then out=$1; elif [[ -z "$drives" ]]; then drives=$1; else usage >&2; exit 2; fi
      shift ;;
  esac
done
[[ -n "$out" && -n "$drives" ]] || { usage >&2; exit 2; }
[[ -d "$drives" ]] || die "'$drives' is no folder; name the one that holds the drives"
parts=${parts:-$out.parts}
mkdir -p "$parts"

list=$parts/drives.tsv
: >"$list"
maps=()
for drive in "$drives"/*/; do
  drive=${drive%/}
  [[ -e "$drive/poses.txt" ]] || { echo "build_fleet: $drive has no poses.txt; passed over" >&2; continue; }
  maps+=("$parts/$(basename "$drive").scanloc")
  printf '%s\t%s\n' "${maps[-1]}" "$drive" >>"$list"
done
[[ ${#maps[@]} -gt 0 ]] || die "no folder in '$drives' has a poses.txt"

self=$(realpath "$0")
if [[ -z "$slurm" ]]; then
  command -v parallel >/dev/null || die "GNU parallel is not installed: apt-get install parallel"
  parallel --will-cite --jobs "${jobs:-100%}" --halt now,fail=1 --colsep '\t' \
    "$self" --build {1} {2} "${options[@]@Q}" :::: "$list"
  merge_all "$out" "${maps[@]}"
else
  command -v sbatch >/dev/null || die "sbatch is not installed; leave out --slurm for this machine alone"
  array=0-$((${#maps[@]} - 1))${jobs:+%$jobs}
  built=$(sbatch --parsable --job-name=scanloc-build --array="$array" --cpus-per-task=1 \
    --output="$parts/%a.log" "$self" --build-nth "$(realpath "$list")" "${options[@]}")
  # Of a merge that never began, since a drive failed, sbatch says that all is well.
  rm -f "$parts/merged"
  sbatch --wait --job-name=scanloc-merge --dependency="afterok:$built" --kill-on-invalid-dep=yes \
    --output="$parts/merge.log" "$self" --merge-and-say "$parts/merged" "$out" "${maps[@]}" \
    >/dev/null || true
  [[ -e "$parts/merged" ]] ||
    die "a job failed; its log is in '$parts'. Run it again to go on: what is done is kept"
fi
echo "built ${#maps[@]} drives into $out"
