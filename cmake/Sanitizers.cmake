if(LKEMU_SANITIZE)
  # Without vptr: it opens pipes to inspect memory and fails in tests that use up all descriptors.
  target_compile_options(lk_options INTERFACE
    -fsanitize=${LKEMU_SANITIZE} -fno-sanitize=vptr -fno-sanitize-recover=all -fno-omit-frame-pointer -D_GLIBCXX_ASSERTIONS)
  target_link_options(lk_options INTERFACE -fsanitize=${LKEMU_SANITIZE})
endif()
