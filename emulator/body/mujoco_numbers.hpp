#pragma once

#include <mujoco/mujoco.h>

#include <string>

namespace lk::emulator {

/// Checks the attributes that `file` and the files it includes are written with: MuJoCo takes "nan"
/// for an attribute that is not given. Throws std::invalid_argument.
void check_written_numbers(const std::string& file);

/// Checks what MuJoCo has made of them. Throws std::invalid_argument.
void check_model_numbers(const mjModel& model, const std::string& file);

}  // namespace lk::emulator
