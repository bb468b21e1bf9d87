# Windows on x86-64: Debian's g++-mingw-w64-x86-64-posix; Wine runs the programs.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
# The programs need no DLL next to them.
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
# Wine keeps its files in the build tree and prints no warnings about missing displays and sound.
set(CMAKE_CROSSCOMPILING_EMULATOR
  env;WINEPREFIX=${CMAKE_BINARY_DIR}/wine;WINEDEBUG=-all;WINEDLLOVERRIDES=mscoree,mshtml,winemenubuilder.exe=;/usr/lib/wine/wine64)
