if(LKEMU_SANITIZE)
  target_compile_options(lk_options INTERFACE
    -fsanitize=${LKEMU_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer -D_GLIBCXX_ASSERTIONS)
  target_link_options(lk_options INTERFACE -fsanitize=${LKEMU_SANITIZE})
endif()

# lk_optimise_in_debug(TARGET): under sanitizers tests take a fifth of the time then.
function(lk_optimise_in_debug target)
  if(LKEMU_SANITIZE)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Debug>:-O1>)
  endif()
endfunction()
