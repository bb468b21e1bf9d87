# Properties of every target of this project, on one interface target.
add_library(lk_options INTERFACE)
target_compile_features(lk_options INTERFACE cxx_std_20)
target_include_directories(lk_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(lk_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wold-style-cast -Wnon-virtual-dtor
  -Wnull-dereference -Wdouble-promotion -Wcast-align -Wimplicit-fallthrough -Wswitch-enum
  # Same input, same bits: no fused multiply-add behind our back.
  -ffp-contract=off
  $<$<BOOL:${LKEMU_WERROR}>:-Werror>)
