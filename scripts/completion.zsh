#compdef scanloc scanlocd scanloc-ros2 scanloc-web
# Completion in zsh: commands and options with what --help says of them.
local -a program=($words[1]) options commands
if [[ ${words[1]:t} == scanloc && $CURRENT -gt 2 ]]; then
  program+=($words[2])
fi
local help
help=$($program --help 2>/dev/null) || return 1
# "--option:what it does"; long options have that on the next line.
options=(${(f)"$(awk '/^  (-h,)?--/ { option = $1; sub(/.*,/, "", option)
                        text = substr($0, 31)
                        if (text == "" || substr($0, 30, 1) != " ") { getline; text = $0 }
                        gsub(/^ +/, "", text); gsub(/:/, "\\:", text); print option ":" text }' \
  <<<"$help")"})
if [[ ${words[1]:t} == scanloc && $CURRENT -eq 2 && $words[2] != -* ]]; then
  commands=(${(f)"$(sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]\+\) \+\(.*\)/\1:\2/p' <<<"$help")"})
  _describe command commands
elif [[ $words[CURRENT] == -* ]]; then
  _describe option options
else
  _files
fi
