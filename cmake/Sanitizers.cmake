if(LKEMU_SANITIZE)
  target_compile_options(lk_options INTERFACE
    -fsanitize=${LKEMU_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(lk_options INTERFACE -fsanitize=${LKEMU_SANITIZE})
endif()

# lk_optimise_in_debug(TARGET...): for what tests spend their time in; under sanitizers they take a fifth of it then.
function(lk_optimise_in_debug)
  foreach(target ${ARGN})
    target_compile_options(${target} PRIVATE $<$<CONFIG:Debug>:-O1>)
  endforeach()
endfunction()
