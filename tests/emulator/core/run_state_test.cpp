// Off, stop, run; misprints; multi-drive mode.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "emulator/core/generation.hpp"
#include "tests/emulator/core/core_support.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace run_state_test {

using namespace std::chrono_literals;
using test::drive;
using test::frame;
using test::Host;
using test::kMfLsb_A;
using test::kMgLsb_A;
using test::send;
using test::servo_config;

constexpr const char* kOff = "141#8000000000000000";
constexpr const char* kStop = "141#8100000000000000";
constexpr const char* kRun = "141#8800000000000000";
constexpr const char* kTorque = "141#A100000064000000";  // 100 LSB = 1.6 A
constexpr const char* kSpeed = "141#A200000010270000";   // 100 dps

// --- off, stop, run

TEST(RunState, RunningAndIdleAfterPowerUp) {
  Host host(servo_config(1));
  EXPECT_EQ(host.run_state(), RunState::kRunning);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
  host.wait(100ms);
  EXPECT_EQ(host.multi_turn_cdeg(), 4500);
}

TEST(RunState, OffRefusesMotionUntilRunIfConfigured) {
  auto config = servo_config(1);
  config.quirks.off_needs_run = true;
  Host host(config);
  host.ask(kOff);
  for (int opcode = 0xA1; opcode <= 0xA8; ++opcode) {
    protocol::Frame query = frame("141#00000000 64 000000");
    query.data[0] = static_cast<std::uint8_t>(opcode);
    EXPECT_EQ(host.ask(query).data[0], opcode);
  }
  host.wait(100ms);
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(host.multi_turn_cdeg(), 4500);
  EXPECT_EQ(host.bus.servo(1).stats.refused_motion, 8U);
  EXPECT_EQ(host.bus.stats().refused_motion, 8U);

  send(host, kRun, 100ms);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(host.multi_turn_cdeg(), 4500);  // on and idle: refused commands are not executed later
  send(host, kSpeed, 100ms);
  EXPECT_NE(host.multi_turn_cdeg(), 4500);
}

/// docs/reference/protocol.md §4.1: a real GYEMS drive moves after 0x80 without 0x88.
TEST(RunState, MotionCommandLeavesOff) {
  for (const char* const command :
       {kTorque, kSpeed, "141#A300000050460000", "141#A400640050460000", "141#A500000050460000",
        "141#A600640050460000", "141#A700000050460000", "141#A800640050460000"}) {
    SCOPED_TRACE(command);
    Host host(servo_config(1));
    send(host, kOff, 1ms);
    EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
    host.ask(command);
    EXPECT_EQ(host.run_state(), RunState::kRunning);
    host.wait(100ms);
    EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
    EXPECT_NE(host.multi_turn_cdeg(), 4500);
    EXPECT_EQ(host.bus.servo(1).stats.refused_motion, 0U);
  }
}

/// An invalid target does not switch the drive on.
TEST(RunState, InvalidTargetLeavesADriveOff) {
  Host host(servo_config(1));
  send(host, {kOff, "141#A5020000 10270000"});
  EXPECT_EQ(host.run_state(), RunState::kOff);
  EXPECT_EQ(host.bus.servo(1).stats.invalid_targets, 1U);
}

TEST(RunState, OffLosesTheTurnCount) {
  Host host(servo_config(1));
  send(host, "141#A3000000 50C30000", 2s);  // 500°
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 50000, 3);
  host.ask(kOff);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 14000, 3);
  EXPECT_NEAR(host.single_turn_cdeg(), 14000, 3);
}

struct Sequence {
  const char* name;
  std::vector<const char*> commands;
  RunState state;
  double i_q_ref_A;
  bool bridge_on = true;
};

TEST(RunState, FollowsOffStopRunAndMotion) {
  for (const Sequence& c :
       {Sequence{"off drops the command", {kSpeed, kOff, kRun}, RunState::kRunning, 0},
        Sequence{"stop keeps the command", {kTorque, kStop}, RunState::kStopped, 0},
        Sequence{"run resumes after a stop", {kTorque, kStop, kRun}, RunState::kRunning, 1.6},
        Sequence{"run while running", {kTorque, kRun}, RunState::kRunning, 1.6},
        Sequence{"motion leaves stop", {kStop, kTorque}, RunState::kRunning, 1.6},
        Sequence{"stop while off", {kOff, kStop}, RunState::kOff, 0, false}}) {
    SCOPED_TRACE(c.name);
    Host host(servo_config(1));
    for (const char* command : c.commands) {
      send(host, command, 1ms);
    }
    EXPECT_EQ(host.run_state(), c.state);
    EXPECT_NEAR(host.bus.truth(1).i_q_ref, c.i_q_ref_A, 1e-9);
    EXPECT_EQ(host.bus.telemetry(1).bridge_on, c.bridge_on);
    EXPECT_EQ(host.bus.servo(1).stats.refused_motion, 0U);
  }
}

/// Returns the angle in degrees by which a load torque moves the shaft in 0.2 s after 0x81.
double drift_after_stop_deg(bool stop_holds) {
  auto config = servo_config(1);
  config.quirks.stop_holds = stop_holds;
  config.profile.drive.load.tau = 0.02;
  Host host(config);
  send(host, kStop, 200ms);
  return static_cast<double>(host.multi_turn_cdeg() - 4500) / 100;
}

TEST(RunState, StopReleasesOrHoldsTheShaft) {
  EXPECT_GT(drift_after_stop_deg(false), 90);
  EXPECT_LT(std::abs(drift_after_stop_deg(true)), 2);
}

// --- misprints and modes

TEST(Quirks, ReplyBytesOfTheManual) {
  auto config = servo_config(1);
  config.quirks.manual_reply_bytes = true;
  Host host(config);
  EXPECT_EQ(host.ask("141#9B00000000000000").data[0], 0x9A);
  EXPECT_EQ(host.ask("141#A700000000000000").data[0], 0xA5);
  EXPECT_EQ(host.ask("141#A800000000000000").data[0], 0xA6);
  for (const int other : {0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0x9A, 0x9C}) {
    protocol::Frame query = frame("141#0000000000000000");
    query.data[0] = static_cast<std::uint8_t>(other);
    EXPECT_EQ(host.ask(query).data[0], other);
  }
}

BusConfig multi_drive_config() {
  BusConfig config = test::bus_config({1, 2, 4, 7});
  for (auto& servo : config.servos) {
    servo.rom.broadcast_mode = servo.id != 2;
  }
  return config;
}

TEST(MultiDrive, TorqueIsAnsweredInOrderOfIds) {
  Host host(multi_drive_config());
  const auto replies = host.talk(frame("280#6400 C800 2C01 9001"));
  ASSERT_EQ(replies.size(), 3U);
  EXPECT_EQ(replies[0].id, 0x141U);
  EXPECT_EQ(replies[1].id, 0x144U);
  EXPECT_EQ(replies[2].id, 0x147U);
  for (const auto& reply : replies) {
    EXPECT_EQ(reply.data[0], 0xA1);
  }
  host.wait(1ms);
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 1.6, 1e-9);
  EXPECT_EQ(host.bus.truth(2).i_q_ref, 0);  // not in the mode
  EXPECT_NEAR(host.bus.truth(4).i_q_ref, 6.4, 1e-9);
  EXPECT_EQ(host.bus.truth(7).i_q_ref, 0);  // in the mode, but without a slot
  EXPECT_EQ(host.bus.stats().queries, 1U);
  EXPECT_EQ(host.bus.stats().replies, 3U);
}

TEST(MultiDrive, SingleDriveFramesAreIgnored) {
  Host host(multi_drive_config());
  EXPECT_TRUE(host.talk(frame("141#9A00000000000000")).empty());
  EXPECT_EQ(host.talk(frame("142#9A00000000000000")).size(), 1U);
  EXPECT_EQ(host.bus.servo(1).stats.wrong_mode, 1U);
  EXPECT_EQ(host.bus.stats().count(Drop::kWrongMode), 1U);
}

TEST(MultiDrive, RefusesMotionWithAnError) {
  BusConfig config = multi_drive_config();
  config.servos[0].rom.protections[0] = {true, 7.0, 0.5, 0.001};
  Host host(config);
  test::supply(host, 6, 100ms);
  EXPECT_EQ(host.talk(frame("280#6400640064006400")).size(), 3U);
  EXPECT_EQ(host.bus.servo(1).stats.refused_motion, 1U);
}

/// v236 drives 1, 2, 3 and 6 and a legacy one, 4, all in multi-drive mode.
Host several() {
  BusConfig config = test::bus_config({});
  config.servos = {
      drive(Generation::kV236, Series::kMg, 1), drive(Generation::kV236, Series::kMf, 2),
      drive(Generation::kV236, Series::kMs, 3), drive(Generation::kLegacy, Series::kMf, 4),
      drive(Generation::kV236, Series::kMg, 6)};
  for (auto& servo : config.servos) servo.rom.broadcast_mode = true;
  return Host(config);
}

using Ids = std::vector<std::uint32_t>;

Ids ids(const std::vector<protocol::Frame>& replies) {
  Ids result;
  for (const auto& reply : replies) result.push_back(reply.id);
  return result;
}

TEST(MultiDrive, TorqueHasTheScaleOfEachDrive) {
  Host host = several();
  const auto replies = host.talk(frame("280#6400640064006400"));
  EXPECT_EQ(ids(replies), (Ids{0x141, 0x142, 0x144, 0x146}));  // MS has no torque command
  host.wait(1ms);
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 100 * kMgLsb_A, 1e-9);
  EXPECT_NEAR(host.bus.truth(2).i_q_ref, 100 * kMfLsb_A, 1e-9);
  EXPECT_NEAR(host.bus.truth(4).i_q_ref, 1.6, 1e-9);
  EXPECT_EQ(host.bus.truth(6).i_q_ref, 0);
}

TEST(MultiDrive, SpeedMovesEachAddressedDrive) {
  Host host = several();
  const auto replies = host.talk(frame("281#680198FE68016801"));  // 360, −360, 360, 360
  EXPECT_EQ(ids(replies), (Ids{0x141, 0x142, 0x143, 0x146}));     // not a legacy command
  for (const auto& reply : replies) {
    auto expected = frame("141#A219000000000008");
    expected.id = reply.id;
    EXPECT_EQ(reply, expected);
  }
  host.wait(1s);
  EXPECT_NEAR(test::speed_dps(host, 1), 360, 10);
  EXPECT_NEAR(test::speed_dps(host, 2), -360, 10);
  EXPECT_NEAR(test::speed_dps(host, 6), 0, 1);
}

TEST(MultiDrive, PositionMovesEachAddressedDrive) {
  Host host = several();
  const auto replies = host.talk(frame("282#1027 F0D8 1027 1027"));  // ±10000 = ±100°
  ASSERT_EQ(ids(replies), (Ids{0x141, 0x142, 0x143, 0x146}));
  EXPECT_EQ(replies[0].data[0], 0xA3);
  host.wait(2s);
  const auto moved_deg = [&](int id) {
    return (host.bus.truth(id).theta_m * 180 / std::numbers::pi) - 45;
  };
  EXPECT_NEAR(moved_deg(1), 55, 0.1);
  EXPECT_NEAR(moved_deg(2), -145, 0.1);
  EXPECT_NEAR(moved_deg(6), 0, 0.1);
}

TEST(MultiDrive, AnyCommandIsAnsweredBySlot) {
  Host host = several();
  const auto replies = host.talk(frame("288#9AFF9C0092009A00"));
  ASSERT_EQ(ids(replies), (Ids{0x141, 0x142, 0x143}));  // 4 is legacy, 6 has no slot
  EXPECT_EQ(replies[0], frame("141#9A19600900000000"));
  EXPECT_EQ(replies[1], frame("142#9C19000000000008"));
  EXPECT_EQ(replies[2], frame("143#9294110000000000"));
  // MS lacks torque, v236 lacks 0x30; the other slots are answered.
  EXPECT_EQ(ids(host.talk(frame("288#3000 8100 A100 9A00"))), (Ids{0x142}));
  EXPECT_EQ(host.bus.servo(1).stats.unknown_commands, 1U);
  EXPECT_EQ(host.bus.servo(3).stats.unknown_commands, 1U);
  EXPECT_EQ(host.bus.servo(6).stats.unknown_commands, 0U);
  EXPECT_EQ(host.run_state(2), RunState::kStopped);
  EXPECT_EQ(host.bus.stats().queries, 2U);
}

TEST(MultiDrive, EmptySlotIsNoCommand) {
  Host host = several();
  EXPECT_EQ(ids(host.talk(frame("288#00FF9A0000000000"))), (Ids{0x142}));
  EXPECT_TRUE(host.talk(frame("288#0000000000000000")).empty());
  for (const int id : {1, 2, 3, 6}) {
    EXPECT_EQ(host.bus.servo(id).stats.unknown_commands, 0U) << id;
  }
  EXPECT_EQ(host.bus.stats().count(Drop::kUnknownCommand), 0U);
  EXPECT_EQ(host.bus.stats().count(Drop::kForeignId), 1U);
}

TEST(MultiDrive, FramesAreIgnoredOutsideTheMode) {
  Host host = Host(drive(Generation::kV236));
  for (const char* text : {"280#0000000000000000", "281#0000000000000000", "282#0000000000000000",
                           "288#9A00000000000000"}) {
    EXPECT_TRUE(host.talk(frame(text)).empty());
  }
  EXPECT_EQ(host.bus.stats().count(Drop::kWrongMode), 4U);
  // Drives outside the mode do not count unknown commands.
  EXPECT_TRUE(host.talk(frame("288#3000000000000000")).empty());
  EXPECT_EQ(host.bus.servo(1).stats.unknown_commands, 0U);
  EXPECT_EQ(host.bus.stats().count(Drop::kUnknownCommand), 0U);
  Host legacy = Host(drive(Generation::kLegacy));
  EXPECT_TRUE(legacy.talk(frame("281#0000000000000000")).empty());
  EXPECT_EQ(legacy.bus.stats().count(Drop::kForeignId), 1U);
}

}  // namespace run_state_test
}  // namespace lk::emulator
