# Sets the hardening flags of Debian's and Ubuntu's compilers, independent of the compiler's defaults.
# tests/package/hardening_test.py checks the installed program. Builds with sanitizers need none.
if(LKEMU_SANITIZE OR NOT LKEMU_PROGRAM)
  return()
endif()
add_compile_options(-fPIE -fstack-protector-strong -fstack-clash-protection)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  add_compile_options(-fcf-protection)
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  add_compile_options(-mbranch-protection=standard)
endif()
# Bounds checks in libc calls; needs optimisation. -U avoids a warning where the distribution already sets it.
add_compile_options($<$<CONFIG:Release,RelWithDebInfo>:-U_FORTIFY_SOURCE> $<$<CONFIG:Release,RelWithDebInfo>:-D_FORTIFY_SOURCE=2>)
add_compile_options(-D_GLIBCXX_ASSERTIONS)
add_link_options(-Wl,-z,relro,-z,now)
if(NOT LKEMU_STATIC)
  add_link_options($<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-pie>)
endif()
