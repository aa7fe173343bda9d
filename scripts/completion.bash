# Completion of scanloc, scanlocd, scanloc-ros2 and scanloc-web in bash: commands and options are those
# that --help tells, so that they are always those of the program that is installed.
_scanloc() {
  local word=${COMP_WORDS[COMP_CWORD]} program=("${COMP_WORDS[0]}")
  # Of scanloc, each command has options of its own.
  if [[ ${COMP_WORDS[0]##*/} == scanloc && $COMP_CWORD -gt 1 ]]; then
    program+=("${COMP_WORDS[1]}")
  fi
  local help
  help=$("${program[@]}" --help 2>/dev/null) || return
  if [[ $word == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(grep -oE '^  (-h,)?--[A-Za-z0-9-]+' <<<"$help" |
      sed 's/.*--/--/')" -- "$word")
  elif [[ ${COMP_WORDS[0]##*/} == scanloc && $COMP_CWORD -eq 1 ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]\+\) .*/\1/p' \
      <<<"$help")" -- "$word")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
    compopt -o filenames
  fi
}
complete -F _scanloc scanloc scanlocd scanloc-ros2 scanloc-web
