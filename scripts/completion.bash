# What bash completes after the programs: commands and options as their help has them, and files.
_forereach() {
  local program=$1 current=$2 words
  words=$("$program" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]*\) .*/\1/p')
  if [[ -n $words ]] && ((COMP_CWORD == 1)); then
    words+=' --help --version'
  elif [[ $current == -* ]]; then
    words=$("$program" ${words:+"${COMP_WORDS[1]}"} --help | sed -nE 's/^  (-[a-zA-Z],)?(--[a-z-]+).*/\2/p')
  else
    words=''
  fi
  COMPREPLY=($(compgen -W "$words" -- "$current"))
}
complete -o default -F _forereach forereach forereach-certifier forereach-planner forereach-logger forereach-robot-sim
