#pragma once

#include <csignal>

namespace lk::emulator {

/// While a thread is made: signals are for the loop's thread, and threads inherit what their maker
/// blocks. Whether the thread comes to be or not, the maker hears signals again.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t all;
    ::sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;
  ~SignalsBlocked() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

 private:
  sigset_t before_{};
};

}  // namespace lk::emulator
