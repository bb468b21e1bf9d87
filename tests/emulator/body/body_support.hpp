#pragma once

/// @file MuJoCo bodies for tests.

#include <fstream>
#include <memory>
#include <sstream>
#include <string>

#include "emulator/body/mujoco_body.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::test {

/// Returns the contents of a file.
inline std::string text_of(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// Loads a model from text.
inline std::shared_ptr<emulator::MujocoBody> body_of(
    const std::string& text, emulator::SimTime step = std::chrono::milliseconds(1)) {
  const TempDirectory directory;
  const std::string file = (directory.path() / "body.xml").string();
  std::ofstream(file) << text;
  return std::make_shared<emulator::MujocoBody>(file, step);
}

/// Equals hand_bodies.hpp's double_pendulum(0.3, 0.25, 1e-5).
inline constexpr const char* kDoublePendulum = R"(
<mujoco><option timestep="0.001" integrator="RK4" gravity="0 0 -9.81"/><worldbody>
  <body name="upper" pos="0 0 1"><joint name="one" type="hinge" axis="0 1 0"/>
    <inertial pos="0 0 -0.25" mass="0.3" diaginertia="1e-5 1e-5 1e-5"/>
    <body name="lower" pos="0 0 -0.25"><joint name="two" type="hinge" axis="0 1 0"/>
      <inertial pos="0 0 -0.25" mass="0.3" diaginertia="1e-5 1e-5 1e-5"/>
    </body></body></worldbody></mujoco>)";

}  // namespace lk::test
