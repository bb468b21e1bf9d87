// Tests the robot's shoulder with lk::emulator alone. The drive has lk-emu's defaults, except for
// the values that these tests need.

#include "host/shoulder_joint.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <lk/emulator/core/faults/make_fault.hpp>
#include <numbers>
#include <stdexcept>

#include "virtual_can.hpp"

namespace robot {
namespace {

using namespace std::chrono_literals;

constexpr int kShoulder = 1;
// The host accepts 0.1°; noise and the encoder's own error add a little.
constexpr double kThere_deg = 0.2;

lk::emulator::BusConfig one_drive() {
  lk::emulator::ServoConfig drive;
  drive.id = kShoulder;
  drive.profile.drive.supply.i_logic = 0.04;          // A: empties the link in half a second
  drive.profile.drive.mechanics.tau_coulomb = 0.013;  // Nm: stops coasting quickly
  drive.profile.drive.mechanics.tau_static = 0.013;
  drive.rom = drive.profile.factory;
  drive.rom.protections[static_cast<std::size_t>(lk::model::Error::kUnderVoltage)] = {
      .enabled = true, .threshold = 18, .hysteresis = 1, .delay = 0.01};
  drive.boot_angle_deg = 0;

  lk::emulator::BusConfig config;
  config.servos = {drive};
  return config;
}

class ShoulderJointTest : public testing::Test {
 protected:
  /// The true angle, independent of the drive's reports.
  double true_angle_deg() const {
    return can.bus.truth(kShoulder).theta_out * 180 / std::numbers::pi;
  }

  VirtualCan can{one_drive()};
  ShoulderJoint joint{can, kShoulder};
};

TEST_F(ShoulderJointTest, IsWhereItWasSentAfterASecond) {
  ASSERT_TRUE(joint.move_to(90, 180));
  can.wait(1s);  // half a second of motion at 180 °/s
  EXPECT_NEAR(joint.angle_deg().value(), 90, kThere_deg);
  EXPECT_NEAR(true_angle_deg(), 90, kThere_deg);
}

TEST_F(ShoulderJointTest, TakesAsLongAsTheWayIs) {
  const auto start = can.bus.time();
  ASSERT_TRUE(joint.move_and_wait(-90, 45, 5s));
  const auto took = can.bus.time() - start;
  EXPECT_GE(took, 1950ms);  // 90° at 45 °/s, minus noise of the speed limit
  EXPECT_LT(took, 2500ms);
}

TEST_F(ShoulderJointTest, NobodyElseAnswersForIt) {
  ShoulderJoint absent(can, 7);
  EXPECT_EQ(absent.angle_deg(), std::nullopt);
  EXPECT_FALSE(absent.move_and_wait(10, 90, 1s));
}

// Turns are counted in RAM: after a power cycle the drive knows only the angle within a turn.
TEST_F(ShoulderJointTest, APowerCycleInterruptsTheMoveAndForgetsTheTurns) {
  ASSERT_TRUE(joint.move_and_wait(450, 720, 3s));
  can.bus.apply({kShoulder, lk::emulator::PowerCycle{}});
  EXPECT_FALSE(joint.move_and_wait(-450, 90, 10s)) << "it lost its power on the way";
  EXPECT_EQ(joint.health(), std::nullopt);

  can.wait(200ms);
  ASSERT_TRUE(joint.health().has_value()) << "it has booted";
  const double left_at_deg = true_angle_deg();
  EXPECT_NEAR(std::remainder(joint.angle_deg().value() - left_at_deg, 360), 0, kThere_deg);
  EXPECT_LE(std::abs(joint.angle_deg().value()), 180);
  EXPECT_GT(left_at_deg, 360);
  EXPECT_TRUE(joint.move_and_wait(0, 180, 3s)) << "and moves again";
}

TEST_F(ShoulderJointTest, ASaggingBatteryTripsTheDriveUntilItIsToldToRecover) {
  ASSERT_TRUE(joint.move_to(90, 30));
  can.wait(500ms);
  can.bus.apply({kShoulder, lk::emulator::Sag{.to_V = 12, .duration = 1s}});
  can.wait(100ms);
  const auto tripped = joint.health().value();
  EXPECT_TRUE(tripped.under_voltage);
  EXPECT_NEAR(tripped.voltage_V, 12, 0.5);
  ASSERT_TRUE(joint.recover());
  EXPECT_TRUE(joint.health()->under_voltage) << "the cause is not over";

  can.wait(1s);
  EXPECT_NEAR(joint.health()->voltage_V, 24, 0.5);
  EXPECT_TRUE(joint.health()->under_voltage) << "nobody has cleared it";
  EXPECT_FALSE(joint.move_and_wait(90, 90, 2s)) << "the bridge is off";

  ASSERT_TRUE(joint.recover());
  EXPECT_TRUE(joint.health()->well());
  EXPECT_TRUE(joint.move_and_wait(90, 90, 2s));
}

TEST_F(ShoulderJointTest, AJammedJointDoesNotArriveAndTheFaultSaysThatItShowed) {
  lk::emulator::Fault jam = lk::emulator::make_fault("jam", {{"percent", 100}}, {kShoulder});
  jam.duration = 1s;
  can.bus.apply({lk::emulator::kWholeBus, lk::emulator::SetFault{jam}});
  EXPECT_FALSE(joint.move_and_wait(90, 180, 900ms));
  can.wait(200ms);
  EXPECT_TRUE(joint.move_and_wait(90, 180, 2s)) << "nothing holds it any more";
  EXPECT_GT(can.bus.faults().front().evidence.effects, 0U);
}

TEST_F(ShoulderJointTest, AMistakeInAFaultIsReported) {
  EXPECT_THROW(lk::emulator::make_fault("jam", {{"percent", 160}}, {kShoulder}),
               std::invalid_argument);
  const auto absent = lk::emulator::make_fault("jam", {}, {7});
  EXPECT_THROW(can.bus.apply({lk::emulator::kWholeBus, lk::emulator::SetFault{absent}}),
               std::out_of_range);
}

// Equal configuration, seed and frame times give bit-identical results. A bus is a value, so its
// copy runs independently.
TEST_F(ShoulderJointTest, ACopyOfTheWorldLivesTheSameLife) {
  ASSERT_TRUE(joint.move_to(90, 180));
  can.wait(200ms);
  VirtualCan other = can;
  ShoulderJoint other_joint(other, kShoulder);
  for (VirtualCan* world : {&can, &other}) {
    world->wait(300ms);
  }
  EXPECT_EQ(joint.angle_deg(), other_joint.angle_deg());
  EXPECT_EQ(can.bus.truth(kShoulder).theta_m, other.bus.truth(kShoulder).theta_m);
}

}  // namespace
}  // namespace robot
