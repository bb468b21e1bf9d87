#include <memory>

#include "emulator/body/mujoco_body.hpp"
#include "emulator/files/profile_files.hpp"
#include "tools/main/bodies.hpp"

void lk::emulator::provide_bodies() {
  use_bodies([](const std::filesystem::path& file, SimTime step) {
    return std::shared_ptr<const Mechanism>(std::make_shared<MujocoBody>(file.string(), step));
  });
}
