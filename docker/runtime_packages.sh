#!/usr/bin/env bash
# The Debian packages whose libraries the programs are linked to, one a line.
set -euo pipefail
ldd "$@" | awk '/=> \// { print $3 }' | sort -u | while read -r library; do
  # dpkg knows a library by the path it was installed to, with or without /usr.
  for path in "$library" "$(realpath "$library")" "/usr$library"; do
    if owner=$(dpkg -S "$path" 2>/dev/null); then
      echo "${owner%%:*}"
      break
    fi
  done
done | sort -u
