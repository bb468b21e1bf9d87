#include <gtest/gtest.h>

#include <functional>
#include <ostream>
#include <string>

#include "tests/emulator/core/core_support.hpp"
#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace protection_test {

using namespace std::chrono_literals;
using model::Error;
using test::Host;
using test::send;
using test::supply;

constexpr const char* kTorque = "141#A100000064000000";  // 100 LSB = 1.6 A
constexpr const char* kRun = "141#8800000000000000";
constexpr const char* kSpeed = "141#A200000010270000";  // 100 dps
constexpr const char* kClearErrors = "141#9B00000000000000";

/// A protection: set-up of its drive, cause, and removal of the cause. Errors are never set
/// directly; supply, heat, currents and motion of the model trip them.
struct Case {
  const char* name;
  Error error;
  model::Protection setting;
  std::function<void(ServoConfig&)> set_up;
  std::function<void(Host&)> provoke;
  std::function<void(Host&)> relieve;
};

void PrintTo(const Case& tripping, std::ostream* out) { *out << tripping.name; }

void nothing(ServoConfig& /*config*/) {}

void block_shaft(ServoConfig& config) { config.profile.drive.load.theta_max = 0.9; }

/// Returns a function that sends a motion command and waits.
auto move(const char* command, SimTime wait) {
  return [=](Host& host) { send(host, command, wait); };
}

auto only_wait(SimTime duration) {
  return [=](Host& host) { host.wait(duration); };
}

void spin_and_brake(Host& host) {
  send(host, "141#A200000020A10700", 1s);     // 5000 dps
  send(host, "141#A2000000E05EF8FF", 200ms);  // −5000 dps
}

const Case kCases[] = {
    {"UnderVoltage",
     Error::kUnderVoltage,
     {true, 18.0, 1.0, 0.002},
     nothing,
     [](Host& host) { supply(host, 12, 10ms); },
     [](Host& host) { supply(host, 24, 10ms); }},
    {"OverVoltage",
     Error::kOverVoltage,
     {true, 32.0, 1.0, 0.0},
     [](ServoConfig& config) {  // a flywheel and a rectifier
       config.profile.drive.supply.i_regen_max = 0.0;
       config.profile.drive.supply.i_logic = 0.04;
       config.profile.drive.load.J = 0.002;
     },
     spin_and_brake,
     only_wait(2s)},  // the electronics discharge the link
    {"DriverTemperature",
     Error::kDriverTemperature,
     {true, 40.0, 10.0, 0.0},
     [](ServoConfig& config) {
       config.profile.drive.thermal.C_stage = 0.1;
       config.profile.drive.load.theta_max = 0.9;
     },
     move("141#A100000058020000", 3s),  // 9.6 A
     only_wait(20s)},
    {"MotorTemperature",
     Error::kMotorTemperature,
     {true, 60.0, 10.0, 0.0},
     [](ServoConfig& config) {
       config.profile.drive.thermal.C_winding = 2.0;
       config.profile.drive.thermal.C_housing = 2.0;
       config.profile.drive.load.theta_max = 0.9;
     },
     move("141#A100000058020000", 20s),  // 9.6 A
     only_wait(120s)},
    {"OverCurrent",
     Error::kOverCurrent,
     {true, 5.0, 1.0, 0.001},
     block_shaft,
     move("141#A100000090010000", 100ms),  // 6.4 A
     only_wait(10ms)},
    {"Short",
     Error::kShort,
     {true, 20.0, 1.0, 0.0},
     block_shaft,
     move("141#A1000000D0070000", 100ms),  // 32 A
     only_wait(10ms)},
    {"Stall",
     Error::kStall,
     {true, 0.3, 0.0, 0.0},
     [](ServoConfig& config) {
       config.profile.drive.load.theta_max = 0.9;
       config.rom.max_torque_current_lsb = 100;
     },
     move(kSpeed, 1s),
     only_wait(10ms)},
    {"LostInput",
     Error::kLostInput,
     {true, 0.1, 0.0, 0.0},
     nothing,
     move(kSpeed, 150ms),
     [](Host& host) { host.ask("141#9C00000000000000"); }},
};

class Tripping : public testing::TestWithParam<Case> {
 protected:
  static ServoConfig drive() {
    ServoConfig config = test::servo_config(1);
    config.quirks.dialect.all_error_bits = true;
    config.rom.protections[static_cast<std::size_t>(GetParam().error)] = GetParam().setting;
    GetParam().set_up(config);
    return config;
  }
  static unsigned errors(Host& host) { return host.ask("141#9A00000000000000").data[7]; }
};

TEST_P(Tripping, OpensTheBridgeUntilClearedAndRun) {
  const unsigned mask = model::bit(GetParam().error);
  Host host(drive());
  EXPECT_EQ(errors(host), 0U);
  GetParam().provoke(host);
  EXPECT_EQ(host.run_state(), RunState::kOff);  // before any query
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(errors(host), mask);
  host.ask(kRun);
  EXPECT_EQ(host.run_state(), RunState::kOff);

  // Answered but not executed.
  const std::uint64_t refused = host.bus.servo(1).stats.refused_motion;
  host.ask(kTorque);
  EXPECT_EQ(host.bus.servo(1).stats.refused_motion, refused + 1);
  host.wait(20ms);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0.0);
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);

  GetParam().relieve(host);
  EXPECT_EQ(errors(host), mask);  // latched after its cause is over
  send(host, kRun, 1ms);
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);  // needs 0x9B
  EXPECT_EQ(host.ask(kClearErrors).data[7], 0U);
  send(host, kTorque, 1ms);
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);  // also needs 0x88
  EXPECT_EQ(host.bus.servo(1).stats.refused_motion, refused + 2);
  send(host, kRun, 1ms);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0.0);  // the command was dropped
  send(host, kTorque, 1ms);
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 1.6, 1e-9);
}

TEST_P(Tripping, HasNoEffectWhenDisabled) {
  ServoConfig config = drive();
  config.rom.protections[static_cast<std::size_t>(GetParam().error)].enabled = false;
  Host host(config);
  GetParam().provoke(host);
  EXPECT_EQ(errors(host), 0U);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
}

TEST_P(Tripping, StaysUntilAPowerCycleWhenNotRecoverable) {
  ServoConfig config = drive();
  config.rom.protections[static_cast<std::size_t>(GetParam().error)].recoverable = false;
  Host host(config);
  GetParam().provoke(host);
  GetParam().relieve(host);
  EXPECT_EQ(host.ask(kClearErrors).data[7], model::bit(GetParam().error));
  host.bus.power_cycle(1);
  host.wait(1ms);
  EXPECT_EQ(errors(host), 0U);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
}

INSTANTIATE_TEST_SUITE_P(Protections, Tripping, testing::ValuesIn(kCases),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(ClearErrors, KeepsErrorsWhoseCausePersists) {
  ServoConfig config = test::servo_config(1);
  config.rom.protections[0] = {true, 18.0, 1.0, 0.0};
  Host host(config);
  supply(host, 12, 10ms);
  EXPECT_EQ(host.ask(kClearErrors).data[7], 1U);
  supply(host, 18.5, 10ms);  // within the hysteresis
  EXPECT_EQ(host.ask(kClearErrors).data[7], 1U);
  supply(host, 19.5, 10ms);
  EXPECT_EQ(host.ask(kClearErrors).data[7], 0U);
}

constexpr auto kIndex = [](Error error) { return static_cast<std::size_t>(error); };

/// A drive with one enabled protection that reports all errors.
ServoConfig watching(Error error, const model::Protection& setting) {
  ServoConfig config = test::servo_config(1);
  config.quirks.dialect.all_error_bits = true;
  config.rom.protections[kIndex(error)] = setting;
  return config;
}

TEST(Delay, ShorterDipsDoNotTripAndDoNotAddUp) {
  Host host(watching(Error::kUnderVoltage, {true, 18.0, 1.0, 0.02}));
  const auto dip = [&](SimTime duration) {
    supply(host, 12, duration);
    supply(host, 24, 5ms);
    return host.bus.telemetry(1).errors;
  };
  for (int n = 0; n < 3; ++n) EXPECT_EQ(dip(17ms), 0U) << n;
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(dip(24ms), model::bit(Error::kUnderVoltage));
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
}

/// 0x9B clears an error only beyond the hysteresis.
TEST(Hysteresis, KeepsAnErrorUntilTheValueIsBelowIt) {
  struct Values {
    Error error;
    model::Protection setting;
    double below, above, within, low;
  };
  for (const Values& c :
       {Values{Error::kOverVoltage, {true, 32.0, 1.0, 0.0}, 31.8, 32.5, 31.2, 30.8},
        Values{Error::kDriverTemperature, {true, 60.0, 10.0, 0.0}, 57, 63, 53, 47},
        Values{Error::kMotorTemperature, {true, 60.0, 10.0, 0.0}, 57, 63, 53, 47}}) {
    SCOPED_TRACE(static_cast<int>(c.error));
    ServoConfig config = watching(c.error, c.setting);
    model::ThermalParams& thermal = config.profile.drive.thermal;
    thermal.C_winding = thermal.C_housing = thermal.C_stage = 0.1;  // follow the ambient
    Host host(config);
    const auto cleared_at = [&](double value) {
      if (c.error == Error::kOverVoltage) {
        supply(host, value, 20ms);
      } else {
        host.bus.apply({1, AmbientTemperature{value}});
        host.wait(10s);
      }
      return host.ask(kClearErrors).data[7] == 0;
    };
    EXPECT_TRUE(cleared_at(c.below));
    EXPECT_FALSE(cleared_at(c.above));
    EXPECT_FALSE(cleared_at(c.within));
    EXPECT_TRUE(cleared_at(c.low));
    EXPECT_TRUE(cleared_at(c.below));  // a cleared error stays cleared up to the threshold
  }
}

TEST(LostInput, MultiDriveFramesResetTheTimeout) {
  ServoConfig config = watching(Error::kLostInput, {true, 0.1, 0.0, 0.0});
  config.rom.broadcast_mode = true;
  Host host(config);
  for (int n = 0; n < 6; ++n) {
    EXPECT_EQ(host.talk(test::frame("280#0000000000000000"), 70ms).size(), 1U);
  }
  EXPECT_EQ(host.bus.telemetry(1).errors, 0U);
  host.talk(test::frame("141#9C00000000000000"), 70ms);  // not in multi-drive mode
  EXPECT_EQ(host.bus.telemetry(1).errors, model::bit(Error::kLostInput));
}

TEST(LostInput, TimeoutStartsAtBoot) {
  ServoConfig config = watching(Error::kLostInput, {true, 0.1, 0.0, 0.0});
  config.profile.drive.logic.boot_time = 0.2;  // longer than the time-out
  Host host(config);
  host.wait(95ms);
  EXPECT_EQ(host.bus.telemetry(1).errors, 0U);
  host.wait(10ms);
  EXPECT_EQ(host.bus.telemetry(1).errors, model::bit(Error::kLostInput));

  supply(host, 0, 50ms);
  supply(host, 24, 290ms);  // includes 200 ms of boot
  EXPECT_EQ(host.bus.telemetry(1).errors, 0U);
  host.wait(20ms);
  EXPECT_EQ(host.bus.telemetry(1).errors, model::bit(Error::kLostInput));
}

TEST(LegacyBits, HiddenErrorTurnsTheBridgeOff) {
  ServoConfig config = watching(Error::kOverVoltage, {true, 32.0, 1.0, 0.0});
  config.quirks.dialect.all_error_bits = false;
  Host host(config);
  supply(host, 33, 20ms);
  supply(host, 24, 20ms);
  EXPECT_EQ(host.ask("141#9A00000000000000").data[7], 0U);
  EXPECT_EQ(host.bus.telemetry(1).errors, model::bit(Error::kOverVoltage));
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(host.run_state(), RunState::kOff);
  send(host, {kRun, kTorque}, 1ms);
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(host.bus.servo(1).stats.refused_motion, 1U);
  EXPECT_EQ(host.ask(kClearErrors).data[7], 0U);
  send(host, kRun, 1ms);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
}

// --- legacy drives

ServoConfig legacy_drive() {
  ServoConfig config = test::servo_config(1);
  config.rom.protections[kIndex(Error::kUnderVoltage)] = {true, 7.0, 0.5, 0.001};
  return config;
}

TEST(LegacyBits, UnderVoltageIsShown) {
  Host host(legacy_drive());
  supply(host, 6, 100ms);
  EXPECT_EQ(host.get<protocol::State1>(protocol::ReadState1{}).errors, 0x01);
}

/// docs/reference/protocol.md §6: a trip drops the command. Later writes to the drive's memory do
/// not restore it, even if the error is cleared before the loops run again.
TEST(Errors, SettingsDoNotRestoreADroppedCommand) {
  const auto write_setting = [](Host& host) {
    host.bus.apply({1, Setting{RomParameter::kMaxSpeed, host.bus.servo(1).rom}});
  };
  const auto flip_bit = [](Host& host) {
    test::inject(host, "ram_flipped", {RomParameter::kMaxSpeed});
  };
  for (const std::function<void(Host&)>& write :
       {std::function<void(Host&)>(write_setting), std::function<void(Host&)>(flip_bit)}) {
    Host host(legacy_drive());
    send(host, kSpeed, 100ms);
    supply(host, 6, 100ms);
    supply(host, 24, 100ms);
    write(host);
    EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
    EXPECT_EQ(host.ask(kClearErrors).data[7], 0x00);
    host.wait(10ms);
    EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
    send(host, kRun, 1ms);
    EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
    EXPECT_EQ(host.bus.truth(1).i_q_ref, 0);
  }
}

TEST(Errors, TripKeepsTheTurnCount) {
  Host host(legacy_drive());
  send(host, "141#A3000000 50C30000", 2s);  // 500°
  supply(host, 6, 100ms);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 50000, 100);  // no longer held
}

/// Frames alone do not clear it. The clearing frame may end the silence itself: it counts as input.
TEST(LostInput, AnyCommandResetsTheTimeoutAndClearErrorsClearsIt) {
  for (const bool motion_first : {false, true}) {
    ServoConfig config = test::servo_config(1);
    config.rom.protections[kIndex(Error::kLostInput)] = {true, 0.1, 0, 0};
    Host host(config);
    for (int k = 0; k < 10; ++k) {
      send(host, "141#9A00000000000000", 50ms);
    }
    EXPECT_EQ(host.bus.telemetry(1).errors, 0U);
    host.wait(100ms);
    if (motion_first) host.ask(kTorque);
    host.wait(1ms);
    EXPECT_EQ(host.bus.telemetry(1).errors, model::bit(Error::kLostInput));
    for (const char* command : {kClearErrors, kRun, kTorque}) host.ask(command);
    EXPECT_EQ(host.bus.servo(1).stats.refused_motion, motion_first ? 1U : 0U);
    host.wait(1ms);
    EXPECT_NEAR(host.bus.truth(1).i_q_ref, 1.6, 1e-9);
  }
}

}  // namespace protection_test
}  // namespace lk::emulator
