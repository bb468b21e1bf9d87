#pragma once

#include <mujoco/mujoco.h>

#include <string>

namespace lk::emulator {

/// Checks attributes in `file` and its includes: MuJoCo treats "nan" as an attribute that is not
/// given. Throws std::invalid_argument.
void check_written_numbers(const std::string& file);

/// Checks the numbers in the compiled model. Throws std::invalid_argument.
void check_model_numbers(const mjModel& model, const std::string& file);

}  // namespace lk::emulator
