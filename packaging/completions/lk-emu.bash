# bash completion for lk-emu and lk-emu-body: asks the program; completes file names if it has no candidate.
COMP_WORDBREAKS=${COMP_WORDBREAKS//:/}  # bus names contain colons
_lk_emu() {
  mapfile -t COMPREPLY < <("$1" __complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
}
complete -o bashdefault -o default -F _lk_emu lk-emu lk-emu-body
