# fish completion for lk-emu and lk-emu-body: asks the program, and also offers file names.
function __lk_emu_complete
    set -l words (commandline -opc) (commandline -ct)
    $words[1] __complete $words[2..-1] 2>/dev/null
end
complete -c lk-emu -a '(__lk_emu_complete)'
complete -c lk-emu-body -a '(__lk_emu_complete)'
