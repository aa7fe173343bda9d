#!/usr/bin/env bash
# Writes the manual pages of programs into OUT/PROGRAM/, from what their --help says (help2man); of
# scanloc, one a command, too.
#   scripts/man_pages.sh OUT PROGRAM...
set -euo pipefail
out=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# page PROGRAM COMMAND...: the page of a program, or of a command of it.
page() {
  local name=${1##*/} title
  [[ $# -eq 1 ]] || name+=-$2
  title=$("$@" --help | sed -n 1p)
  title=${title%.}
  # help2man sees where an option ends by a wide gap; the narrow one is widened.
  cat >"$work/$name" <<END
#!/bin/sh
if [ "\$1" = --version ]; then "$1" --version | sed "s/^[^ ]*/$name/"; exit; fi
"$1" ${2:-} --help | sed -E 's/^  scanloc/\\n&/; s/^(  -.{26}) ([^ ])/\\1  \\2/'
END
  chmod +x "$work/$name"
  help2man --no-info --name="${title,}" --source=scanloc "$work/$name" |
    gzip -9n >"$out/${1##*/}/$name.1.gz"
}

for program in "${@:2}"; do
  mkdir -p "$out/${program##*/}"
  page "$program"
  if [[ ${program##*/} == scanloc ]]; then
    while read -r command; do
      page "$program" "$command"
    done < <("$program" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]\+\) .*/\1/p')
  fi
done
