# What this project asks of its own code. By directory, not by target: who links the libraries, from an
# install or with add_subdirectory, keeps warnings of their own.
add_compile_options(
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wold-style-cast -Wnon-virtual-dtor
  -Wnull-dereference -Wdouble-promotion -Wcast-align -Wimplicit-fallthrough -Wswitch-enum
  $<$<BOOL:${LKEMU_WERROR}>:-Werror>)
# GCC 12 takes `"text" + std::string` for overlapping memory when it optimises (its bug 105329, fixed in 13).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  add_compile_options(-Wno-restrict)
endif()

# The same program from any directory: __FILE__ says where below the project a line stands.
add_compile_options(-fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=)

# What every user of the libraries needs as well, outside this project too; exported as lk::options.
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
# Same input, same bits: no fused multiply-add behind our back. The headers hold inline physics, of which the
# linker keeps one copy, and that may be the user's: on ARM, or with -march=native, theirs would be fused.
target_compile_options(lk_options INTERFACE -ffp-contract=off)
