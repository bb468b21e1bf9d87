# bash completion for lk-emu and lk-emu-body: asks the program; files where it knows no candidate.
COMP_WORDBREAKS=${COMP_WORDBREAKS//:/}  # the names of buses have colons
_lk_emu() {
  mapfile -t COMPREPLY < <("$1" __complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
}
complete -o bashdefault -o default -F _lk_emu lk-emu lk-emu-body
