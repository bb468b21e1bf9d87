// 0x18: the drive moves the shaft to and fro and reports how well the encoder followed.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string_view>

#include "emulator/core/generation.hpp"
#include "tests/emulator/core/faults/fault_support.hpp"
#include "tests/support/profile.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace calibration_test {

using namespace std::chrono_literals;
using test::frame;
using test::Host;

ServoConfig drive(const char* motor = "mg4005") {
  ServoConfig servo;
  servo.id = 1;
  servo.profile = test::profile(motor);
  servo.generation = Generation::kV236b;
  servo.quirks = quirks_of(Generation::kV236b);
  servo.rom = servo.profile.factory;
  servo.boot_angle_deg = 45;
  return servo;
}

constexpr const char* kCalibrate = "141#1800000000000000";
const protocol::Frame kState2 = frame("141#9C00000000000000");

int ratio_permille(const protocol::Frame& reply) { return reply.data[5] + 256 * reply.data[6]; }
bool is_done(const protocol::Frame& reply) {
  constexpr auto kDone = protocol::kCalibrationDone;
  return reply.data[0] == 0x18 && (reply.data[7] & kDone) == kDone;
}

/// Replies to other commands during the calibration.
ServoConfig answering_drive() {
  ServoConfig servo = drive();
  servo.quirks.calibrate_busy = CalibrateBusy::kAnswers;
  return servo;
}

TEST(Calibration, MovesTwoElectricalTurnsAndRepliesAtTheEnd) {
  for (const char* motor : {"mg4005", "mf7015", "ms3506", "mg8016", "mf9025"}) {
    SCOPED_TRACE(motor);
    Host host(drive(motor));
    const double start = host.bus.truth(1).theta_m;
    host.bus.receive({host.bus.time(), frame(kCalibrate)});
    double most = 0;
    for (int n = 0; n < 399; ++n) {
      host.wait(10ms);
      most = std::max(most, std::abs(host.bus.truth(1).theta_m - start));
    }
    std::vector<TimedFrame> replies;
    host.bus.take_replies(replies);
    EXPECT_TRUE(replies.empty());
    host.wait(50ms);
    host.bus.take_replies(replies);
    ASSERT_EQ(replies.size(), 1U);
    const int ratio = ratio_permille(replies[0].frame);
    // Friction delays the rotor by part of a quarter of an electrical turn at each of the two ends;
    // it cannot run ahead.
    EXPECT_GE(ratio, 900);
    EXPECT_LE(ratio, 1010);
    EXPECT_TRUE(is_done(replies[0].frame));
    const double turns = 2.0 / host.bus.servo(1).config.profile.drive.motor.pole_pairs;
    EXPECT_NEAR(most / (2 * std::numbers::pi), turns, 0.15 * turns);
    EXPECT_EQ(host.bus.servo(1).wear[static_cast<std::size_t>(RomParameter::kAlignValue)], 1U);
  }
}

TEST(Calibration, OtherCommandsGetNoReplyMeanwhile) {
  Host host(drive());
  EXPECT_TRUE(host.talk(frame(kCalibrate), 1s).empty());
  EXPECT_TRUE(host.talk(kState2, 1s).empty());
  EXPECT_TRUE(host.talk(frame("141#A200000040380000"), 1s).empty());
  EXPECT_EQ(host.talk(kState2, 1500ms).size(), 1U);  // the reply to 0x18
  EXPECT_EQ(host.talk(kState2, 10ms).size(), 1U);
}

TEST(Calibration, OtherCommandsGetRepliesWithTheQuirk) {
  Host host(answering_drive());
  EXPECT_TRUE(host.talk(frame(kCalibrate), 500ms).empty());
  EXPECT_EQ(host.talk(kState2, 10ms).size(), 1U);
  EXPECT_EQ(host.talk(frame("141#A200000040380000"), 10ms).size(), 1U);  // not executed
  const auto reply = host.talk(frame("141#9200000000000000"), 5s);
  ASSERT_EQ(reply.size(), 2U);
  EXPECT_TRUE(is_done(reply[1]));
}

TEST(Calibration, SecondCommandMeanwhileHasNoEffect) {
  Host host(answering_drive());
  EXPECT_TRUE(host.talk(frame(kCalibrate), 1s).empty());
  EXPECT_TRUE(host.talk(frame(kCalibrate), 1s).empty());
  const auto replies = host.talk(kState2, 2500ms);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_TRUE(is_done(replies[1]));
}

TEST(Calibration, FramesMeanwhileKeepTheInputAlive) {
  ServoConfig servo = drive();
  servo.rom.protections[static_cast<std::size_t>(model::Error::kLostInput)] = {true, 0.5, 0, 0};
  Host host(servo);
  std::vector<protocol::Frame> replies = host.talk(frame(kCalibrate));
  for (int n = 0; n < 410; ++n) {
    for (const auto& one : host.talk(frame("141#9A00000000000000"), 10ms)) replies.push_back(one);
  }
  ASSERT_FALSE(replies.empty());
  EXPECT_TRUE(is_done(replies[0]));
}

TEST(Calibration, RepliesAtOnceWithZerosWhileOff) {
  Host host(drive());
  host.talk(frame("141#8000000000000000"), 10ms);
  EXPECT_EQ(host.talk(frame(kCalibrate), 10ms), std::vector{frame(kCalibrate)});
}

TEST(Calibration, FailsWithAJamOrAStuckEncoder) {
  for (const char* kind : {"jam", "encoder_stuck"}) {
    Host host(drive());
    test::inject(host, kind);
    const auto replies = host.talk(frame(kCalibrate), 5s);
    ASSERT_EQ(replies.size(), 1U) << kind;
    EXPECT_EQ(replies[0].data[7] & 1, 0) << kind;
    if (std::string_view(kind) != "jam") continue;
    EXPECT_LT(ratio_permille(replies[0]), 900);
    EXPECT_EQ(host.bus.stats().rom_writes, 0U);
  }
}

TEST(Calibration, PowerCycleEndsItWithoutReplyOrWrite) {
  Host host(drive());
  host.talk(frame(kCalibrate), 1s);
  host.bus.power_cycle(1);
  host.wait(5s);
  std::vector<TimedFrame> replies;
  host.bus.take_replies(replies);
  EXPECT_TRUE(replies.empty());
  EXPECT_EQ(host.bus.stats().rom_writes, 0U);
}

TEST(Calibration, AlignValueDependsOnTheSeed) {
  const auto align = [](std::uint64_t seed) {
    BusConfig config = test::bus_config({});
    config.servos.push_back(drive());
    config.seed = seed;
    Host host(config);
    const auto replies = host.talk(frame(kCalibrate), 5s);
    return std::vector(replies.at(0).data.begin() + 1, replies.at(0).data.begin() + 5);
  };
  EXPECT_EQ(align(1), align(1));
  EXPECT_NE(align(1), align(2));
}

}  // namespace calibration_test
}  // namespace lk::emulator
