# What Debian's and Ubuntu's compilers harden programs with, whatever the defaults of the compiler at hand are;
# tests/package/hardening_test.py holds the installed program against it. Sanitizers watch for themselves.
if(LKEMU_SANITIZE OR NOT LKEMU_PROGRAM)
  return()
endif()
add_compile_options(-fPIE -fstack-protector-strong -fstack-clash-protection)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  add_compile_options(-fcf-protection)
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  add_compile_options(-mbranch-protection=standard)
endif()
# Reads a buffer's size off the optimiser; distributions that set it themselves are not warned of a second time.
add_compile_options($<$<CONFIG:Release,RelWithDebInfo>:-U_FORTIFY_SOURCE> $<$<CONFIG:Release,RelWithDebInfo>:-D_FORTIFY_SOURCE=2>)
add_compile_options(-D_GLIBCXX_ASSERTIONS)
add_link_options(-Wl,-z,relro,-z,now)
if(NOT LKEMU_STATIC)
  add_link_options($<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-pie>)
endif()
