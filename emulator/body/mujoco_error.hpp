#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace lk::emulator {

/// An error for which MuJoCo would end the process.
struct MujocoError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Stops MuJoCo from ending the process or printing: errors become MujocoError, warnings stay in
/// the data.
void tame_mujoco();

/// Returns MuJoCo's message on one line.
std::string mujoco_words(std::string_view text);

}  // namespace lk::emulator
