// Off, stop, run; errors; misprints; multi-drive mode.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "emulator/core/servo/servo.hpp"
#include "tests/emulator/core/faults/fault_support.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace run_state_test {

using namespace std::chrono_literals;
using test::frame;
using test::Host;
using test::servo_config;

// --- off, stop, run

TEST(RunState, OnAndIdleAfterPowerUp) {
  Host host(servo_config(1));
  EXPECT_EQ(host.run_state(), RunState::kRunning);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
  host.wait(100ms);
  EXPECT_EQ(host.multi_turn_cdeg(), 4500);
}

TEST(RunState, OffRefusesMotionUntilRunWhereTheSwitchSaysSo) {
  auto config = servo_config(1);
  config.quirks.off_needs_run = true;
  Host host(config);
  host.ask("141#8000000000000000");
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

  host.ask("141#8800000000000000");
  host.wait(100ms);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(host.multi_turn_cdeg(), 4500);  // on and idle: refused commands are not executed later
  host.ask("141#A200000010270000");
  host.wait(100ms);
  EXPECT_NE(host.multi_turn_cdeg(), 4500);
}

/// docs/reference/protocol.md §4.1: a real GYEMS drive moves after 0x80 without 0x88.
TEST(RunState, MotionCommandLeavesOff) {
  for (const char* const command :
       {"141#A100000064000000", "141#A200000010270000", "141#A300000050460000",
        "141#A400640050460000", "141#A500000050460000", "141#A600640050460000",
        "141#A700000050460000", "141#A800640050460000"}) {
    SCOPED_TRACE(command);
    Host host(servo_config(1));
    host.ask("141#8000000000000000");
    host.wait(1ms);
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
TEST(RunState, AnInvalidTargetLeavesADriveOff) {
  Host host(servo_config(1));
  host.ask("141#8000000000000000");
  host.ask("141#A5020000 10270000");
  EXPECT_EQ(host.run_state(), RunState::kOff);
  EXPECT_EQ(host.bus.servo(1).stats.invalid_targets, 1U);
}

TEST(RunState, OffLosesTheTurnCount) {
  Host host(servo_config(1));
  host.ask("141#A3000000 50C30000");  // 500°
  host.wait(2s);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 50000, 3);
  host.ask("141#8000000000000000");
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 14000, 3);
  EXPECT_NEAR(host.single_turn_cdeg(), 14000, 3);
}

TEST(RunState, OffForgetsTheCommand) {
  Host host(servo_config(1));
  host.ask("141#A200000010270000");
  host.wait(200ms);
  host.ask("141#8000000000000000");
  host.ask("141#8800000000000000");
  host.wait(1ms);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0);
}

TEST(RunState, StopKeepsTheCommandAndRunResumes) {
  Host host(servo_config(1));
  host.ask("141#A100000064000000");
  host.wait(1ms);
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 1.6, 1e-9);
  host.ask("141#8100000000000000");
  EXPECT_EQ(host.run_state(), RunState::kStopped);
  host.wait(1ms);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
  host.ask("141#8800000000000000");
  host.wait(1ms);
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 1.6, 1e-9);
}

TEST(RunState, RunNeedNotResume) {
  auto config = servo_config(1);
  config.quirks.run_resumes = false;
  Host host(config);
  host.ask("141#A100000064000000");
  host.ask("141#8100000000000000");
  host.ask("141#8800000000000000");
  host.wait(1ms);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0);
  EXPECT_EQ(host.run_state(), RunState::kRunning);
}

TEST(RunState, RunWhileRunningChangesNothing) {
  Host host(servo_config(1));
  host.ask("141#A100000064000000");
  host.ask("141#8800000000000000");
  host.wait(1ms);
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 1.6, 1e-9);
}

TEST(RunState, MotionCommandLeavesStopped) {
  Host host(servo_config(1));
  host.ask("141#8100000000000000");
  host.ask("141#A1000000C8000000");
  EXPECT_EQ(host.run_state(), RunState::kRunning);
  host.wait(1ms);
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 3.2, 1e-9);
  EXPECT_EQ(host.bus.servo(1).stats.refused_motion, 0U);
}

TEST(RunState, StopWhileOffStaysOff) {
  Host host(servo_config(1));
  host.ask("141#8000000000000000");
  host.ask("141#8100000000000000");
  EXPECT_EQ(host.run_state(), RunState::kOff);
}

/// Returns the angle in degrees by which a load torque moves the shaft in 0.2 s after 0x81.
double drift_after_stop_deg(bool stop_holds) {
  auto config = servo_config(1);
  config.quirks.stop_holds = stop_holds;
  config.profile.drive.load.tau = 0.02;
  Host host(config);
  host.ask("141#8100000000000000");
  host.wait(200ms);
  return static_cast<double>(host.multi_turn_cdeg() - 4500) / 100;
}

TEST(RunState, StopFreesTheShaftOrHoldsIt) {
  EXPECT_GT(drift_after_stop_deg(false), 90);
  EXPECT_LT(std::abs(drift_after_stop_deg(true)), 2);
}

TEST(RunState, PowerCycleStartsOver) {
  Host host(servo_config(1));
  host.ask("141#A3000000 50C30000");
  host.wait(2s);
  host.ask("141#8000000000000000");
  host.bus.power_cycle(1);
  EXPECT_EQ(host.run_state(), RunState::kRunning);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 14000, 3);
  host.wait(10ms);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0);
}

// --- errors

ServoConfig protected_config() {
  auto config = servo_config(1);
  auto& protections = config.rom.protections;
  protections[static_cast<std::size_t>(model::Error::kUnderVoltage)] = {true, 7.0, 0.5, 0.001};
  protections[static_cast<std::size_t>(model::Error::kOverVoltage)] = {true, 60.0, 1.0, 0.001};
  return config;
}

int error_state(Host& host) { return host.get<protocol::State1>(protocol::ReadState1{}).errors; }

TEST(Errors, TripTurnsOffUntilClearedAndRun) {
  Host host(protected_config());
  host.ask("141#A200000010270000");
  host.wait(100ms);
  host.bus.set_supply_voltage(1, 6.0);
  host.wait(100ms);
  EXPECT_EQ(error_state(host), 0x01);
  EXPECT_EQ(host.run_state(), RunState::kOff);
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);

  // The cause persists: neither 0x9B nor 0x88 helps.
  EXPECT_EQ(host.ask("141#9B00000000000000").data[7], 0x01);
  host.ask("141#8800000000000000");
  EXPECT_EQ(host.run_state(), RunState::kOff);
  host.ask("141#A100000064000000");
  EXPECT_EQ(host.bus.servo(1).stats.refused_motion, 1U);

  host.bus.set_supply_voltage(1, 24.0);
  host.wait(100ms);
  EXPECT_EQ(error_state(host), 0x01);  // latched
  host.ask("141#8800000000000000");
  EXPECT_EQ(host.run_state(), RunState::kOff);
  EXPECT_EQ(host.ask("141#9B00000000000000").data[7], 0x00);  // shows the remaining errors
  host.ask("141#A100000064000000");
  EXPECT_EQ(host.bus.servo(1).stats.refused_motion, 2U);  // cleared, but still off
  host.ask("141#8800000000000000");
  host.wait(1ms);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0);  // the trip dropped the earlier command
  host.ask("141#A100000064000000");
  host.wait(1ms);
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 1.6, 1e-9);
}

/// The drive switches off before any query sees the trip.
TEST(Errors, ATripNeedsNobodyToAsk) {
  Host host(protected_config());
  host.ask("141#A200000010270000");
  host.wait(100ms);
  EXPECT_EQ(host.run_state(), RunState::kRunning);
  host.bus.set_supply_voltage(1, 6.0);
  host.wait(100ms);
  EXPECT_EQ(host.run_state(), RunState::kOff);
}

/// docs/reference/protocol.md §6: a trip drops the command. Later writes to the drive's memory do
/// not restore it, even if the error is cleared before the loops run again.
TEST(Errors, NoSettingBringsBackWhatATripDropped) {
  const auto somebody_writes = [](Host& host) {
    host.bus.apply({1, Setting{RomParameter::kMaxSpeed, host.bus.servo(1).rom}});
  };
  const auto a_bit_flips = [](Host& host) {
    test::inject(host, "ram_flipped", {RomParameter::kMaxSpeed});
  };
  for (const std::function<void(Host&)>& write :
       {std::function<void(Host&)>(somebody_writes), std::function<void(Host&)>(a_bit_flips)}) {
    Host host(protected_config());
    host.ask("141#A200000010270000");
    host.wait(100ms);
    host.bus.set_supply_voltage(1, 6.0);
    host.wait(100ms);
    host.bus.set_supply_voltage(1, 24.0);
    host.wait(100ms);
    write(host);
    EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
    EXPECT_EQ(host.ask("141#9B00000000000000").data[7], 0x00);
    host.wait(10ms);
    EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
    host.ask("141#8800000000000000");
    host.wait(1ms);
    EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
    EXPECT_EQ(host.bus.truth(1).i_q_ref, 0);
  }
}

TEST(Errors, TripKeepsTheTurnCount) {
  Host host(protected_config());
  host.ask("141#A3000000 50C30000");
  host.wait(2s);
  host.bus.set_supply_voltage(1, 6.0);
  host.wait(100ms);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 50000, 100);  // no longer held
}

TEST(Errors, OthersThanTheTwoOfTheManualAreNotShown) {
  Host host(protected_config());
  host.bus.set_supply_voltage(1, 65.0);
  host.wait(100ms);
  EXPECT_EQ(error_state(host), 0);
  EXPECT_EQ(host.bus.telemetry(1).errors, model::bit(model::Error::kOverVoltage));
  host.ask("141#A100000064000000");
  EXPECT_EQ(host.bus.servo(1).stats.refused_motion, 1U);
}

TEST(Errors, PowerCycleClears) {
  Host host(protected_config());
  host.bus.set_supply_voltage(1, 6.0);
  host.wait(100ms);
  host.bus.set_supply_voltage(1, 24.0);
  host.wait(100ms);
  host.bus.power_cycle(1);
  EXPECT_EQ(error_state(host), 0);
  host.ask("141#A100000064000000");
  host.wait(1ms);
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 1.6, 1e-9);
}

TEST(Errors, LostInput) {
  auto config = servo_config(1);
  config.rom.protections[static_cast<std::size_t>(model::Error::kLostInput)] = {true, 0.1, 0, 0};
  Host host(config);
  for (int k = 0; k < 10; ++k) {
    host.ask("141#9A00000000000000");  // any command resets the time-out
    host.wait(50ms);
  }
  EXPECT_EQ(host.bus.telemetry(1).errors, 0);
  host.wait(100ms);
  EXPECT_EQ(host.bus.telemetry(1).errors, model::bit(model::Error::kLostInput));
  host.ask("141#A100000064000000");
  EXPECT_EQ(host.bus.servo(1).stats.refused_motion, 1U);
  host.wait(1ms);
  EXPECT_EQ(host.bus.telemetry(1).errors,
            model::bit(model::Error::kLostInput));  // frames alone do not clear it
  host.ask("141#9B00000000000000");
  host.ask("141#8800000000000000");
  host.ask("141#A100000064000000");
  host.wait(1ms);
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 1.6, 1e-9);
}

/// The clearing frame may end the silence itself: it counts as input.
TEST(Errors, LostInputIsClearedByTheFirstFrameAfterTheSilence) {
  auto config = servo_config(1);
  config.rom.protections[static_cast<std::size_t>(model::Error::kLostInput)] = {true, 0.1, 0, 0};
  Host host(config);
  host.wait(500ms);
  ASSERT_EQ(host.bus.telemetry(1).errors, model::bit(model::Error::kLostInput));
  host.ask("141#9B00000000000000");
  host.ask("141#8800000000000000");
  host.ask("141#A100000064000000");
  host.wait(1ms);
  EXPECT_EQ(host.bus.servo(1).stats.refused_motion, 0U);
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 1.6, 1e-9);
}

// --- misprints and modes

TEST(Quirks, ManualReplyBytes) {
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

TEST(MultiDrive, AnswersInOrderOfIdsAsForTorque) {
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

TEST(MultiDrive, IgnoredWithTheModeOff) {
  Host host(test::bus_config({1, 2}));
  EXPECT_TRUE(host.talk(frame("280#6400640064006400")).empty());
  EXPECT_EQ(host.bus.stats().count(Drop::kWrongMode), 1U);
}

TEST(MultiDrive, RefusedWithAnError) {
  BusConfig config = multi_drive_config();
  config.servos[0].rom.protections[0] = {true, 7.0, 0.5, 0.001};
  Host host(config);
  host.bus.set_supply_voltage(1, 6.0);
  host.wait(100ms);
  EXPECT_EQ(host.talk(frame("280#6400640064006400")).size(), 3U);
  EXPECT_EQ(host.bus.servo(1).stats.refused_motion, 1U);
}

}  // namespace run_state_test
}  // namespace lk::emulator
