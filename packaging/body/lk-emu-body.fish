# fish completion for lk-emu-body, which takes what lk-emu takes.
complete -c lk-emu-body -w lk-emu
