# What bash completes after `forereach`: commands and options as its help has them, and files.
_forereach() {
  local cur prev words cword
  _init_completion || return
  if ((cword == 1)); then
    COMPREPLY=($(compgen -W "$(forereach --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]*\) .*/\1/p') --help --version" -- "$cur"))
  elif [[ $cur == -* ]]; then
    COMPREPLY=($(compgen -W "$(forereach "${words[1]}" --help | grep -o -- '--[a-z-]*' | sort -u)" -- "$cur"))
  else
    _filedir
  fi
}
complete -F _forereach forereach
