// States that simulators send for joints, and the refused ones.
#include "emulator/io/shafts/shaft_body.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace lk::emulator {
namespace shaft_body_test {

constexpr SimTime kStep = std::chrono::milliseconds(1);
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

ShaftBody body_of(std::uint32_t owner, std::uint32_t flags = 0, double armature = 0.01) {
  return ShaftBody({{"vcan0:1", {owner, flags}, 0.5, 2.0, armature}}, kStep);
}

std::string problem(const ShaftBody& body, const lk_shafts_state& state) {
  return body.problem_of({&state, 1}).value_or("");
}

void take(ShaftBody& body, const lk_shafts_state& state) { body.take({&state, 1}); }

void advance(ShaftBody& body, const JointTorque& torque) { body.advance({&torque, 1}); }

TEST(ShaftBody, RejectsInvalidNumbersAndJoints) {
  const ShaftBody body = body_of(LK_SHAFTS_SIMULATOR);
  EXPECT_EQ(problem(body, {1, 2, 0.1, 3}), "");
  EXPECT_EQ(problem(body, {1, 2, 0, 0}), "") << "not known";
  EXPECT_EQ(problem(body, {kNan, 2, 0.1, 3}), "vcan0:1: angle_rad is nan");
  EXPECT_EQ(problem(body, {1, -kInfinity, 0.1, 3}), "vcan0:1: speed_rad_s is -inf");
  EXPECT_EQ(problem(body, {1, 2, -0.1, 3}), "vcan0:1: inertia_kg_m2 is -0.1");
  EXPECT_EQ(problem(body, {1, 2, 0.1, 1e300}), "vcan0:1: torque_Nm is 1e+300");
  EXPECT_EQ(problem(body, {1, 2, 0.009, 3}),
            "vcan0:1: inertia_kg_m2 is 0.009, below the drive's armature of 0.01");
  EXPECT_EQ(problem(body_of(LK_SHAFTS_SIMULATOR, 0, 0), {1, 2, 0, 3}),
            "vcan0:1: inertia_kg_m2 is 0; must be above 0, as the drive has no armature");
}

TEST(ShaftBody, IgnoresAngleAndSpeedOfDriveOwnedJoints) {
  ShaftBody body = body_of(LK_SHAFTS_DRIVE);
  EXPECT_EQ(problem(body, {kNan, kNan, 0.2, 3}), "");
  take(body, {kNan, kNan, 0.2, 3});
  EXPECT_EQ(body.joint(0).angle_rad, 0.5);
  EXPECT_EQ(body.joint(0).speed_rad_s, 2.0);
  EXPECT_DOUBLE_EQ(body.joint(0).inertia_kg_m2, 0.21) << "with its own";
  EXPECT_EQ(body.joint(0).body_torque_Nm, 3.0);
}

TEST(ShaftBody, InfersTheExternalTorque) {
  // 0.04 kg·m² with 2 Nm from the drive and −3 Nm from gravity: −25 rad/s².
  ShaftBody body = body_of(LK_SHAFTS_SIMULATOR, LK_SHAFTS_TORQUE_UNTOLD);
  take(body, {0.5, 2.0, 0.04, kNan});
  EXPECT_EQ(body.joint(0).body_torque_Nm, 0.0) << "nothing is known yet";
  advance(body, {2.0, 0, 0.502, 2.1});
  take(body, {0.502, 1.975, 0.04, kNan});
  EXPECT_NEAR(body.joint(0).body_torque_Nm, -3.0, 1e-12);
}

TEST(ShaftBody, UsesTheArmatureAsDefaultInertia) {
  ShaftBody body = body_of(LK_SHAFTS_SIMULATOR);
  take(body, {0.5, 2.0, 0, 0});
  EXPECT_EQ(body.joint(0).inertia_kg_m2, 0.01);
  advance(body, {2.0, 0, 0.502, 2.1});
  take(body, {0.502, 2.0, 0, 0});
  EXPECT_EQ(body.joint(0).body_torque_Nm, -2.0) << "it holds still, so something holds it";
}

TEST(ShaftBody, AveragesOverUnansweredSteps) {
  ShaftBody body = body_of(LK_SHAFTS_SIMULATOR);
  take(body, {0.5, 2.0, 0.04, 0});
  advance(body, {1.0, 0, 0.502, 2.1});
  EXPECT_EQ(body.joint(0).angle_rad, 0.502) << "where the drive has it";
  advance(body, {3.0, 7, 0.504, 2.2});
  EXPECT_EQ(body.steps(), 2U);
  EXPECT_EQ(body.torques()[0].torque_Nm, 2.0);
  EXPECT_EQ(body.torques()[0].torque_slope_Nm_s, 7.0);
  EXPECT_EQ(body.torques()[0].speed_rad_s, 2.2);
}

TEST(ShaftBody, UpdatesInertiaWhenTheArmatureChanges) {
  ShaftBody body = body_of(LK_SHAFTS_SIMULATOR);
  take(body, {0.5, 2.0, 0.04, 0});
  body.set_armature(0, 0.001);  // the coupling breaks
  EXPECT_DOUBLE_EQ(body.joint(0).inertia_kg_m2, 0.031);
}

}  // namespace shaft_body_test
}  // namespace lk::emulator
