if(LKEMU_SANITIZE)
  target_compile_options(lk_options INTERFACE
    -fsanitize=${LKEMU_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer -D_GLIBCXX_ASSERTIONS)
  target_link_options(lk_options INTERFACE -fsanitize=${LKEMU_SANITIZE})
endif()
