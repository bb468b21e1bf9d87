# Linux on 64-bit ARM: Debian's g++-aarch64-linux-gnu; QEMU user mode runs the programs.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_CXX_FLAGS_INIT -Wno-psabi)  # GCC notes the ABI change of version 10
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)  # QEMU then needs no libraries of that processor
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static)
