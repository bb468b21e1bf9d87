# Linux on ARM, 64 bits: Debian's g++-aarch64-linux-gnu; QEMU's user mode runs what it makes.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_CXX_FLAGS_INIT -Wno-psabi)  # GCC tells what it did before its version 10
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)  # QEMU needs no library of that processor then
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static)
