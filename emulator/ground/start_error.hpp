#pragma once

#include <stdexcept>
#include <string>
#include <system_error>

namespace lk::emulator {

/// Why the program cannot start: one line for the person who typed the command. Exit status 2.
struct StartError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What the system says of an errno.
inline std::string reason_of(int error) { return std::generic_category().message(error); }

}  // namespace lk::emulator
