#include "emulator/body/mujoco_error.hpp"

#include <mujoco/mujoco.h>

#include "emulator/ground/text.hpp"

namespace lk::emulator {

void tame_mujoco() {
  // MuJoCo does not expect the handler to return.
  mju_user_error = [](const char* text) { throw MujocoError(text); };
  mju_user_warning = [](const char* /*text*/) {};
}

std::string mujoco_words(std::string_view text) {
  std::string line;
  for (const char one : text.substr(0, text.find_last_not_of('\n') + 1)) {
    line += one == '\n' ? std::string("; ") : std::string(1, one);
  }
  return on_one_line(line);
}

}  // namespace lk::emulator
