#pragma once

#include <stdexcept>
#include <string>
#include <system_error>

namespace lk::emulator {

/// The program cannot start: one line for the user. Exit status 2.
struct StartError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Returns the system's text for an errno.
inline std::string errno_text(int error) { return std::generic_category().message(error); }

}  // namespace lk::emulator
