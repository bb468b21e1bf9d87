// The robot's shoulder with the motor that it has, and an arm that hangs on it: TOML, as lk-emu
// reads it, and lk-emu's own motor files.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "emulator/config.hpp"
#include "emulator/profile.hpp"
#include "host/shoulder_joint.hpp"
#include "virtual_can.hpp"

namespace robot {
namespace {

using namespace std::chrono_literals;

lk::emulator::Profile motor(const std::string& name) {
  const std::string path = LK_EMU_CONFIGS_DIR "/motors/" + name + ".toml";
  std::ifstream file(path);
  if (!file) {
    throw std::runtime_error("cannot read " + path);
  }
  std::ostringstream text;
  text << file.rdbuf();
  return lk::emulator::parse_profile(text.str(), path, name);
}

/// An arm of 0.05 kg·m², hanging at 0°, that takes `torque_Nm` to hold when it is horizontal.
lk::emulator::BusConfig arm(const std::string& torque_Nm) {
  const std::string text = R"(
    [[bus]]
    interface = "arm"
    [[bus.drive]]
    id = 1
    motor = "mf7015"
    boot_angle_deg = 0
    load = { J_g_cm2 = 500000, tau_gravity_Nm = )" +
                           torque_Nm + R"( }
    [bus.drive.settings]
    acceleration_dps_s = 360
  )";
  return lk::emulator::parse_config(text, "arm.toml", {}, motor).front();
}

TEST(Arm, IsLiftedByAMotorThatIsStrongEnough) {
  VirtualCan can(arm("0.8"));  // rated for 1 Nm
  EXPECT_TRUE(ShoulderJoint(can, 1).move_and_wait(90, 90, 5s));
}

TEST(Arm, IsNotLiftedByAMotorThatIsTooWeak) {
  VirtualCan can(arm("4.0"));  // Max Torque Current, 16 A · 0.105 Nm/A, is 1.7 Nm
  EXPECT_FALSE(ShoulderJoint(can, 1).move_and_wait(90, 90, 5s));
}

}  // namespace
}  // namespace robot
