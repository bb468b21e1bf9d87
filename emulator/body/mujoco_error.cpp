#include "emulator/body/mujoco_error.hpp"

#include <mujoco/mujoco.h>

namespace lk::emulator {

void tame_mujoco() {
  // Whoever calls does not expect it to return.
  mju_user_error = [](const char* text) { throw MujocoError(text); };
  mju_user_warning = [](const char* /*text*/) {};
}

}  // namespace lk::emulator
