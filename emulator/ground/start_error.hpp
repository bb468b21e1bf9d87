#pragma once

#include <stdexcept>

namespace lk::emulator {

/// Why the program cannot start: one line for the person who typed the command. Exit status 2.
struct StartError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace lk::emulator
