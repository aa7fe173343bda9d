#!/usr/bin/env bash
# For evaluate.sh and ablations.sh, which source it: made query sets. Needs $scanloc and $work.
# shellcheck disable=SC2154

simulate() { # FOLDER ARGUMENTS...
  rm -rf "$1"
  "$scanloc" simulate "$@" --quiet >/dev/null
}

# join FOLDER DRIVES...: one drive of the scans of several, their poses behind each other.
join() {
  local out=$1 number=0 drive scan
  shift
  rm -rf "$out"
  mkdir -p "$out/velodyne"
  for drive in "$@"; do
    for scan in "$drive"/velodyne/*.bin; do
      ln "$scan" "$out/velodyne/$(printf %06d "$number").bin"
      number=$((number + 1))
    done
    cat "$drive/poses.txt" >>"$out/poses.txt"
  done
}

# simulate_mixed FOLDER ARGUMENTS...: revisits of all four kinds in one query set: in the lane, 3.5 m
# to the side, reverse, and both.
simulate_mixed() {
  local out=$1
  shift
  simulate "$work/same" "$@" --session-seed 2
  simulate "$work/lateral" "$@" --session-seed 3 --lane-shift-m 3.5
  simulate "$work/reverse" "$@" --session-seed 4 --reverse
  simulate "$work/both" "$@" --session-seed 5 --reverse --lane-shift-m 3.5
  join "$out" "$work/same" "$work/lateral" "$work/reverse" "$work/both"
  rm -rf "$work/same" "$work/lateral" "$work/reverse" "$work/both"
}
