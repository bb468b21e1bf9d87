# Warnings for this project's own code. Set by directory, not by target, so that projects that link the libraries keep
# their own warnings.
add_compile_options(
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wold-style-cast -Wnon-virtual-dtor
  -Wnull-dereference -Wdouble-promotion -Wcast-align -Wimplicit-fallthrough -Wswitch-enum
  $<$<BOOL:${LKEMU_WERROR}>:-Werror>)
# GCC 12 reports overlapping memory for `"text" + std::string` when optimising (GCC bug 105329, fixed in 13).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  add_compile_options(-Wno-restrict)
endif()

# __FILE__ is relative to the project, so builds from different directories are identical.
add_compile_options(-fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=)

# lk::options: flags and include paths that all users of the libraries need.
add_library(lk_options INTERFACE)
target_compile_features(lk_options INTERFACE cxx_std_20)
target_include_directories(lk_options INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
# Users write <lk/emulator/core/bus.hpp>, with an install and with add_subdirectory.
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/include/lk)
foreach(directory protocol model emulator)
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${directory} ${PROJECT_BINARY_DIR}/include/lk/${directory} SYMBOLIC)
endforeach()
# Equal input gives equal bits: no fused multiply-add. The linker keeps one copy of inline physics in the headers,
# perhaps the user's; on ARM or with -march=native that copy would otherwise be fused.
target_compile_options(lk_options INTERFACE -ffp-contract=off)
