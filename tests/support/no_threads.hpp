#pragma once

#include <pthread.h>

#include <cstddef>

namespace lk::test {

/// While it exists no thread can be created, as on a machine out of threads: each would need a
/// stack larger than the address space.
class NoThreads {
 public:
  NoThreads() {
    ::pthread_attr_init(&attributes_);
    ::pthread_getattr_default_np(&attributes_);
    ::pthread_attr_getstacksize(&attributes_, &before_);
    set(std::size_t{1} << 58U);
  }
  NoThreads(const NoThreads&) = delete;
  NoThreads& operator=(const NoThreads&) = delete;
  ~NoThreads() {
    set(before_);
    ::pthread_attr_destroy(&attributes_);
  }

 private:
  void set(std::size_t stack_bytes) {
    ::pthread_attr_setstacksize(&attributes_, stack_bytes);
    ::pthread_setattr_default_np(&attributes_);
  }

  pthread_attr_t attributes_{};
  std::size_t before_ = 0;
};

}  // namespace lk::test
