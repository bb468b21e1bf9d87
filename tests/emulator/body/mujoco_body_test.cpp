// MuJoCo as a mechanism: refused models, state, and explosions.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <limits>

#include "tests/emulator/body/body_support.hpp"

namespace lk::test {
namespace mujoco_body_test {

using emulator::JointTorque;
using emulator::MujocoBody;

std::string refusal(const std::string& text) {
  try {
    body_of(text);
  } catch (const std::invalid_argument& problem) {
    return problem.what();
  }
  return "";
}

const std::string kArm =
    R"(<body><joint name="hip" axis="0 1 0"/><geom type="sphere" size=".1" mass="1" pos="0 0 -1"/></body>)";

TEST(MujocoBody, SaysInItsWordsWhatIsWrongWithAModel) {
  EXPECT_NE(refusal("<mujoco><worldbody><body>").find("XML"), std::string::npos);
  EXPECT_NE(refusal("<mujoco><worldbody>" + kArm + R"(<geom type="mesh" mesh="no"/></worldbody>
    <asset><mesh name="no" file="no.stl"/></asset></mujoco>)")
                .find("no.stl"),
            std::string::npos);
  EXPECT_NE(refusal(R"(<mujoco><worldbody><body><joint name="a"/><inertial pos="0 0 0" mass="0"
    diaginertia="0 0 0"/></body></worldbody></mujoco>)")
                .find("mass"),
            std::string::npos);
  EXPECT_NE(refusal("<mujoco><worldbody/></mujoco>").find("no hinge"), std::string::npos);
  EXPECT_EQ(refusal("<mujoco><worldbody>" + kArm + "</worldbody></mujoco>"), "");
}

TEST(MujocoBody, RefusesNumbersThatAreNotFinite) {
  const auto with = [](const std::string& option, const std::string& geom) {
    return refusal("<mujoco><option " + option + R"(/><worldbody><body name="nan 1">
      <!-- mass="nan" --><joint name="hip" axis="0 1 0"/><geom type="sphere" size=".1" )" +
                   geom + "/></body></worldbody></mujoco>");
  };
  EXPECT_EQ(with("", "mass='1'"), "");
  EXPECT_NE(with("", "mass='nan'").find("mass=\"nan\" is not a finite number"), std::string::npos);
  EXPECT_NE(with("", "mass='1' pos='0 0 -inf'").find("pos=\"0 0 -inf\""), std::string::npos);
  EXPECT_NE(with("gravity = '0 0 1e999'", "mass='1'").find("gravity=\"0 0 1e999\""),
            std::string::npos);
}

TEST(MujocoBody, ReadsThePiecesThatAModelIncludes) {
  const TempDirectory directory;
  const std::string file = (directory.path() / "body.xml").string();
  std::ofstream(file) << R"(<mujoco><worldbody><include file="arm.xml"/></worldbody></mujoco>)";
  std::ofstream(directory.path() / "arm.xml")
      << R"(<mujoco><body><joint axis="0 1 0"/><geom size=".1" density="nan"/></body></mujoco>)";
  try {
    const MujocoBody body(file, std::chrono::milliseconds(1));
    FAIL() << "accepted";
  } catch (const std::invalid_argument& problem) {
    EXPECT_NE(std::string(problem.what()).find("arm.xml: density=\"nan\""), std::string::npos)
        << problem.what();
  }
}

TEST(MujocoBody, DoesNotWaitForTheWriterOfAPipe) {
  const TempDirectory directory;
  const std::string file = (directory.path() / "body.xml").string();
  ASSERT_EQ(::mkfifo((directory.path() / "pipe.stl").c_str(), 0600), 0);
  std::ofstream(file) << "<mujoco><worldbody>" + kArm +
                             R"(<geom type="mesh" mesh="pipe"/></worldbody>
                             <asset><mesh name="pipe" file="pipe.stl"/></asset></mujoco>)";
  try {
    const MujocoBody body(file, std::chrono::milliseconds(1));
    FAIL() << "accepted";
  } catch (const std::invalid_argument& problem) {
    EXPECT_NE(std::string(problem.what()).find("pipe.stl"), std::string::npos) << problem.what();
  }
}

TEST(MujocoBody, HasABoundOfMemory) {
  EXPECT_NE(refusal("<mujoco><worldbody>" + kArm + R"(<body name="grain" pos="0 0 1">
    <composite type="particle" count="1000 1000 1" spacing="0.05"><geom size=".02"/></composite>
    </body></worldbody></mujoco>)")
                .find("needs more than 1 GiB of memory"),
            std::string::npos);
}

TEST(MujocoBody, BeginsInItsFirstKeyframe) {
  const auto body = body_of("<mujoco><worldbody>" + kArm +
                            R"(</worldbody><keyframe><key qpos="0.7"/></keyframe></mujoco>)");
  EXPECT_EQ(body->joint(0).angle_rad, 0.7);
  EXPECT_NEAR(body->joint(0).inertia_kg_m2, 1 + 0.4 * 0.01, 1e-12);  // m·l² + 2/5·m·r²
  EXPECT_NEAR(body->joint(0).body_torque_Nm, -9.81 * std::sin(0.7), 1e-9);
}

/// In the air a joint feels the foot's inertia alone; on the floor it also feels the floor.
TEST(MujocoBody, FeelsTheFloorInTheJoint) {
  const auto leg = [](const char* height) {
    return body_of(
        std::string(R"(<mujoco><option timestep=".001"/><worldbody>
      <geom type="plane" size="1 1 1"/><body pos="0 0 )") +
        height +
        R"("><joint name="knee" axis="0 1 0"/><geom type="sphere" size=".1" mass="0.1" pos=".5 0 0"/>
      </body></worldbody></mujoco>)");
  };
  const double own = 0.1 * (0.25 + 0.4 * 0.01);
  EXPECT_NEAR(leg("1")->joint(0).inertia_kg_m2, own, 1e-9);
  EXPECT_GT(leg("0.0999")->joint(0).inertia_kg_m2, 3 * own);
}

/// A kilogram at one metre, pushed with 2 N for 10 ms: 2·0.01/(1 + 0.004) rad/s.
TEST(MujocoBody, IsPushedLoadedAndHeld) {
  const auto body = body_of(R"(<mujoco><option timestep=".001" gravity="0 0 0"/><worldbody>
      <body name="arm"><joint name="hip" axis="0 1 0"/><geom type="sphere" size=".1" mass="1"
      pos="0 0 -1"/></body></worldbody></mujoco>)");
  const JointTorque nothing[1] = {};
  ASSERT_EQ(body->parts().size(), 2U);
  body->push(1, {-2, 0, 0}, {0, 0, 0});
  body->update();
  for (int n = 0; n < 10; ++n) {
    body->advance(nothing);
    body->update();
  }
  body->push(1, {0, 0, 0}, {0, 0, 0});
  EXPECT_NEAR(body->joint(0).speed_rad_s, 0.02 / 1.004, 1e-6);
  body->carry(1, 2.0);
  body->update();
  EXPECT_NEAR(body->joint(0).inertia_kg_m2, 3.004, 1e-9);
  body->freeze(true);
  body->update();
  const double angle = body->joint(0).angle_rad;
  body->advance(nothing);
  EXPECT_EQ(body->joint(0).angle_rad, angle);
  EXPECT_EQ(body->joint(0).speed_rad_s, 0);
}

/// A kilogram at one metre with 0.004 kg·m² of its own; it hangs, so gravity pulls at 0.1 rad.
TEST(MujocoBody, IsAUrdfToo) {
  const auto body = body_of(R"(<robot name="arm"><link name="base"/>
      <link name="arm"><inertial><origin xyz="0 0 -1"/><mass value="1"/>
        <inertia ixx="0.004" iyy="0.004" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="hip" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
        <limit lower="-1" upper="2" effort="10" velocity="10"/></joint></robot>)");
  ASSERT_EQ(body->joints().size(), 1U);
  EXPECT_EQ(body->joints()[0], "hip");
  EXPECT_EQ(body->stops(0), (std::array{-1.0, 2.0}));
  EXPECT_FALSE(body->has_floor());
  body->pose({.keyframe = {}, .part = 0, .position_m = {}, .rpy_rad = {}, .joints = {{0, 0.1}}});
  body->update();
  EXPECT_NEAR(body->joint(0).inertia_kg_m2, 1.004, 1e-9);
  EXPECT_NEAR(body->joint(0).body_torque_Nm, -9.81 * std::sin(0.1), 1e-9);
}

TEST(MujocoBody, SaysWhereItExplodes) {
  const auto body = body_of(kDoublePendulum);
  const JointTorque torques[2] = {{0, 0}, {1e300, 0}};
  for (int n = 0; n < 10; ++n) {
    body->advance(torques);
    body->update();
  }
  ASSERT_TRUE(body->failure());
  EXPECT_NE(body->failure()->find("out of bounds, at joint "), std::string::npos)
      << *body->failure();
  const auto copy = body->clone();
  EXPECT_TRUE(copy->failure());
}

}  // namespace mujoco_body_test
}  // namespace lk::test
