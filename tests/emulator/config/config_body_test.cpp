// [body] and the joints of drives in robot files (docs/body.md).

#include "emulator/config/config_body.hpp"

#include <gtest/gtest.h>

#include "tests/emulator/config/config_support.hpp"
#include "tests/emulator/coupling/hand_bodies.hpp"

namespace lk::emulator {
namespace config_body_test {

const std::string kRobot = "[body]\nmodel = \"arm.xml\"\n[[bus]]\ninterface = \"vcan0\"\n";
const std::string kDrive = "[[bus.drive]]\nid = 1\n";

/// Two joints, the second at 0.5 rad.
std::shared_ptr<const Mechanism> load(const std::string& file, const std::string& model,
                                      SimTime step) {
  if (model != "arm.xml") throw std::invalid_argument("no " + model + " beside " + file);
  return std::make_shared<test::HandBody>(2, test::double_pendulum(1, 1), step, test::Two{0, 0.5});
}

std::vector<BusConfig> read(const std::string& text, const LoadBody& by = load) {
  return parse_config(text, "robot.toml", {}, find_test_profile, by);
}
std::string error(const std::string& text, const LoadBody& by = load) {
  try {
    read(text, by);
  } catch (const ConfigError& problem) {
    return problem.what();
  }
  return "accepted";
}

TEST(ConfigBody, ADriveTurnsAJoint) {
  const auto buses =
      read(kRobot + kDrive + "joint = \"joint_0\"\n" + "[[bus.drive]]\nid = 2\n" +
           "joint = { name = \"joint_1\", direction = -1, ratio = 2, offset_deg = 90 }");
  ASSERT_TRUE(buses[0].body);
  EXPECT_EQ(buses[0].body->step(), std::chrono::milliseconds(1));
  EXPECT_EQ(buses[0].servos[0].joint->joint, 0U);
  const JointLink& second = *buses[0].servos[1].joint;
  EXPECT_EQ(second.joint, 1U);
  EXPECT_EQ(second.rate, -2);
  EXPECT_EQ(second.start_rad, 0.5);
  EXPECT_NEAR(second.output_of(3.14159265 / 2), 0, 1e-8);
  EXPECT_NEAR(second.output_of(0), 3.14159265, 1e-8);
}

TEST(ConfigBody, SaysWhatIsWrongAndWhatToDo) {
  const std::string drive = kRobot + kDrive;
  EXPECT_EQ(
      error(drive, {}),
      "robot.toml:1: body: this robot needs the package lk-emu-body: run lk-emu-body instead");
  EXPECT_EQ(error(drive + "joint = \"joint_3\""),
            "robot.toml:7: bus.drive.joint: \"joint_3\" is not one of joint_0, joint_1");
  EXPECT_EQ(error(drive + "joint = \"joint_0\"\n[[bus.drive]]\nid = 2\njoint = \"joint_0\""),
            "robot.toml:10: bus.drive.joint: another drive turns this joint already");
  EXPECT_EQ(error(drive + "joint = \"joint_0\"\nload = { tau_Nm = 1 }"),
            "robot.toml:8: bus.drive.load: the body is the load of a drive with a joint");
  EXPECT_EQ(
      error(drive + "joint = \"joint_0\"\nboot_angle_deg = 1"),
      "robot.toml:8: bus.drive.boot_angle_deg: a drive with a joint starts where the body has "
      "it: use offset_deg");
  EXPECT_EQ(error("[body]\nmodel = \"leg.xml\"\n"),
            "robot.toml:2: body.model: no leg.xml beside robot.toml");
  EXPECT_EQ(error("[[bus]]\ninterface = \"vcan0\"\n" + kDrive + "joint = \"joint_0\""),
            "robot.toml:5: bus.drive.joint: the robot has no [body]");
  const std::string odd =
      "[body]\nmodel = \"arm.xml\"\nstep_ms = 0.99\n[[bus]]\ninterface = \"vcan0\"\n";
  EXPECT_NE(error(odd + kDrive + "joint = \"joint_0\"")
                .find("is no whole number of this drive's PWM periods"),
            std::string::npos);
}

TEST(ConfigBody, IsNotLoadedNorTurnedByHand) {
  const std::string event = kRobot + kDrive + "joint = \"joint_0\"\n[[bus.event]]\nat_s = 1\n";
  for (const char* const action : {"turn_deg = 3", "load = { tau_Nm = 1 }"}) {
    EXPECT_NE(error(event + action).find("drive 1 turns a joint of the body, which is its load"),
              std::string::npos)
        << action;
  }
  EXPECT_EQ(error(event + "freeze = true"), "accepted");
  EXPECT_NE(
      error("[[bus]]\ninterface = \"vcan0\"\n" + kDrive + "[[bus.event]]\nat_s = 1\nfreeze = true")
          .find("the robot has no [body]"),
      std::string::npos);
}

}  // namespace config_body_test
}  // namespace lk::emulator
