// Tests the robot's shoulder with its real motor and an arm on it, described in TOML with lk-emu's
// own motor files.

#include <gtest/gtest.h>

#include <fstream>
#include <lk/emulator/config/config.hpp>
#include <lk/emulator/config/profile.hpp>
#include <sstream>
#include <stdexcept>
#include <string>

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

/// An arm that hangs at 0° and carries `mass_kg` 10 cm from the shaft.
lk::emulator::BusConfig arm(double mass_kg) {
  const std::string text = R"(
    [[bus]]
    interface = "arm"
    [[bus.drive]]
    id = 1
    motor = "mf7015"
    boot_angle_deg = 0
    load = { J_g_cm2 = )" + std::to_string(mass_kg * 100'000) +
                           R"(, tau_gravity_Nm = )" + std::to_string(mass_kg * 9.81 * 0.1) + R"( }
    [bus.drive.settings]     # stiff for a load of many rotors, and unhurried
    gains = { angle_kp = 100, angle_ki = 5, speed_kp = 255, speed_ki = 40 }
    acceleration_dps_s = 180
  )";
  return lk::emulator::parse_config(text, "arm.toml", {}, motor).front();
}

TEST(Arm, IsLiftedByAMotorThatIsStrongEnough) {
  VirtualCan can(arm(0.8));  // 0.8 Nm at 90°; the motor is rated for 1 Nm
  ShoulderJoint joint(can, 1);
  EXPECT_TRUE(joint.move_and_wait(90, 90, 5s));
  can.wait(2s);
  EXPECT_NEAR(joint.angle_deg().value(), 90, 0.2) << "and held";
}

TEST(Arm, IsNotLiftedByAMotorThatIsTooWeak) {
  VirtualCan can(arm(4));  // 3.9 Nm; Max Torque Current, 16 A · 0.105 Nm/A, allows 1.7 Nm
  EXPECT_FALSE(ShoulderJoint(can, 1).move_and_wait(90, 90, 5s));
}

}  // namespace
}  // namespace robot
