#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace lk::emulator {

/// What MuJoCo would have ended the process for.
struct MujocoError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// From now on MuJoCo neither ends the process nor prints: its errors are MujocoError, its warnings
/// are found in the data.
void tame_mujoco();

/// Its words on one line.
std::string mujoco_words(std::string_view text);

}  // namespace lk::emulator
