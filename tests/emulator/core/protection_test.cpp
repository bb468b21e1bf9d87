#include <gtest/gtest.h>

#include <functional>
#include <ostream>
#include <string>

#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace protection_test {

using namespace std::chrono_literals;
using model::Error;
using test::Host;

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

void spin_and_brake(Host& host) {
  host.ask("141#A200000020A10700");  // 5000 dps
  host.wait(1s);
  host.ask("141#A2000000E05EF8FF");  // −5000 dps
  host.wait(200ms);
}

const Case kCases[] = {
    {"UnderVoltage",
     Error::kUnderVoltage,
     {true, 18.0, 1.0, 0.002},
     nothing,
     [](Host& host) {
       host.bus.apply({1, SupplyVoltage{12.0, 0ns}});
       host.wait(10ms);
     },
     [](Host& host) {
       host.bus.apply({1, SupplyVoltage{24.0, 0ns}});
       host.wait(10ms);
     }},
    {"OverVoltage",
     Error::kOverVoltage,
     {true, 32.0, 1.0, 0.0},
     [](ServoConfig& config) {  // a flywheel and a rectifier
       config.profile.drive.supply.i_regen_max = 0.0;
       config.profile.drive.supply.i_logic = 0.04;
       config.profile.drive.load.J = 0.002;
     },
     spin_and_brake,
     [](Host& host) { host.wait(2s); }},  // the electronics discharge the link
    {"DriverTemperature",
     Error::kDriverTemperature,
     {true, 40.0, 10.0, 0.0},
     [](ServoConfig& config) {
       config.profile.drive.thermal.C_stage = 0.1;
       config.profile.drive.load.theta_max = 0.9;
     },
     [](Host& host) {
       host.ask("141#A100000058020000");  // 9.6 A
       host.wait(3s);
     },
     [](Host& host) { host.wait(20s); }},
    {"MotorTemperature",
     Error::kMotorTemperature,
     {true, 60.0, 10.0, 0.0},
     [](ServoConfig& config) {
       config.profile.drive.thermal.C_winding = 2.0;
       config.profile.drive.thermal.C_housing = 2.0;
       config.profile.drive.load.theta_max = 0.9;
     },
     [](Host& host) {
       host.ask("141#A100000058020000");
       host.wait(20s);
     },
     [](Host& host) { host.wait(120s); }},
    {"OverCurrent",
     Error::kOverCurrent,
     {true, 5.0, 1.0, 0.001},
     [](ServoConfig& config) { config.profile.drive.load.theta_max = 0.9; },
     [](Host& host) {
       host.ask("141#A100000090010000");  // 6.4 A
       host.wait(100ms);
     },
     [](Host& host) { host.wait(10ms); }},
    {"Short",
     Error::kShort,
     {true, 20.0, 1.0, 0.0},
     [](ServoConfig& config) { config.profile.drive.load.theta_max = 0.9; },
     [](Host& host) {
       host.ask("141#A1000000D0070000");  // 32 A
       host.wait(100ms);
     },
     [](Host& host) { host.wait(10ms); }},
    {"Stall",
     Error::kStall,
     {true, 0.3, 0.0, 0.0},
     [](ServoConfig& config) {
       config.profile.drive.load.theta_max = 0.9;
       config.rom.max_torque_current_lsb = 100;
     },
     [](Host& host) {
       host.ask("141#A200000010270000");
       host.wait(1s);
     },
     [](Host& host) { host.wait(10ms); }},
    {"LostInput",
     Error::kLostInput,
     {true, 0.1, 0.0, 0.0},
     nothing,
     [](Host& host) {
       host.ask("141#A200000010270000");
       host.wait(150ms);
     },
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

TEST_P(Tripping, LatchesOpensTheBridgeAndComesBackInOrder) {
  const unsigned mask = model::bit(GetParam().error);
  Host host(drive());
  EXPECT_EQ(errors(host), 0U);
  GetParam().provoke(host);
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(errors(host), mask);
  EXPECT_EQ(host.run_state(), RunState::kOff);

  // Answered but not executed.
  host.ask("141#A100000064000000");
  host.wait(20ms);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0.0);
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);

  GetParam().relieve(host);
  EXPECT_EQ(errors(host), mask);  // latched after its cause is over
  host.ask("141#8800000000000000");
  host.wait(1ms);
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);  // needs 0x9B
  EXPECT_EQ(host.ask("141#9B00000000000000").data[7], 0U);
  host.ask("141#A100000064000000");
  host.wait(1ms);
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);  // also needs 0x88
  host.ask("141#8800000000000000");
  host.wait(1ms);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0.0);  // the command was dropped
}

TEST_P(Tripping, NotWhenDisabled) {
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
  EXPECT_EQ(host.ask("141#9B00000000000000").data[7], model::bit(GetParam().error));
  host.bus.power_cycle(1);
  host.wait(1ms);
  EXPECT_EQ(errors(host), 0U);
}

INSTANTIATE_TEST_SUITE_P(Protections, Tripping, testing::ValuesIn(kCases),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(ClearErrors, KeepsWhatIsNotOver) {
  ServoConfig config = test::servo_config(1);
  config.rom.protections[0] = {true, 18.0, 1.0, 0.0};
  Host host(config);
  host.bus.apply({1, SupplyVoltage{12.0, 0ns}});
  host.wait(10ms);
  EXPECT_EQ(host.ask("141#9B00000000000000").data[7], 1U);
  host.bus.apply({1, SupplyVoltage{18.5, 0ns}});  // within the hysteresis
  host.wait(10ms);
  EXPECT_EQ(host.ask("141#9B00000000000000").data[7], 1U);
  host.bus.apply({1, SupplyVoltage{19.5, 0ns}});
  host.wait(10ms);
  EXPECT_EQ(host.ask("141#9B00000000000000").data[7], 0U);
}

constexpr auto kIndex = [](Error error) { return static_cast<std::size_t>(error); };

/// A drive with one enabled protection that reports all errors.
ServoConfig watching(Error error, const model::Protection& setting) {
  ServoConfig config = test::servo_config(1);
  config.quirks.dialect.all_error_bits = true;
  config.rom.protections[kIndex(error)] = setting;
  return config;
}

TEST(Delay, ADipThatIsShorterDoesNotTripAndDipsDoNotAddUp) {
  Host host(watching(Error::kUnderVoltage, {true, 18.0, 1.0, 0.02}));
  const auto dip = [&](SimTime duration) {
    host.bus.apply({1, SupplyVoltage{12.0, 0ns}});
    host.wait(duration);
    host.bus.apply({1, SupplyVoltage{24.0, 0ns}});
    host.wait(5ms);
    return host.bus.telemetry(1).errors;
  };
  for (int n = 0; n < 3; ++n) EXPECT_EQ(dip(17ms), 0U) << n;
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(dip(24ms), model::bit(Error::kUnderVoltage));
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
}

/// Checks whether 0x9B clears the error at values near the hysteresis.
TEST(Hysteresis, OverVoltageIsOverBelowIt) {
  Host host(watching(Error::kOverVoltage, {true, 32.0, 1.0, 0.0}));
  const auto cleared_at = [&](double supply_V) {
    host.bus.apply({1, SupplyVoltage{supply_V, 0ns}});
    host.wait(20ms);
    return host.ask("141#9B00000000000000").data[7] == 0;
  };
  EXPECT_TRUE(cleared_at(31.8));
  EXPECT_FALSE(cleared_at(32.5));
  EXPECT_FALSE(cleared_at(31.2));
  EXPECT_TRUE(cleared_at(30.8));
  EXPECT_TRUE(cleared_at(31.8)) << "between the two it is what it was";
}

TEST(Hysteresis, TemperaturesAreOverBelowIt) {
  for (const Error error : {Error::kDriverTemperature, Error::kMotorTemperature}) {
    SCOPED_TRACE(static_cast<int>(error));
    ServoConfig config = watching(error, {true, 60.0, 10.0, 0.0});
    model::ThermalParams& thermal = config.profile.drive.thermal;
    thermal.C_winding = thermal.C_housing = thermal.C_stage = 0.1;  // follow the ambient
    Host host(config);
    const auto cleared_at = [&](double ambient_C) {
      host.bus.apply({1, AmbientTemperature{ambient_C}});
      host.wait(10s);
      return host.ask("141#9B00000000000000").data[7] == 0;
    };
    EXPECT_TRUE(cleared_at(57));
    EXPECT_FALSE(cleared_at(63));
    EXPECT_FALSE(cleared_at(53));
    EXPECT_TRUE(cleared_at(47));
    EXPECT_TRUE(cleared_at(57));
  }
}

TEST(LostInput, TheFramesForSeveralFeedADriveThatHearsNothingElse) {
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

TEST(LostInput, TheFirstWindowBeginsWhenTheControllerHasBooted) {
  ServoConfig config = watching(Error::kLostInput, {true, 0.1, 0.0, 0.0});
  config.profile.drive.logic.boot_time = 0.2;  // longer than the time-out
  Host host(config);
  host.wait(95ms);
  EXPECT_EQ(host.bus.telemetry(1).errors, 0U);
  host.wait(10ms);
  EXPECT_EQ(host.bus.telemetry(1).errors, model::bit(Error::kLostInput));

  host.bus.apply({1, SupplyVoltage{0.0, 0ns}});
  host.wait(50ms);
  host.bus.apply({1, SupplyVoltage{24.0, 0ns}});
  host.wait(290ms);  // includes 200 ms of boot
  EXPECT_EQ(host.bus.telemetry(1).errors, 0U);
  host.wait(20ms);
  EXPECT_EQ(host.bus.telemetry(1).errors, model::bit(Error::kLostInput));
}

TEST(LegacyBits, AnErrorThatIsNotShownTurnsTheBridgeOffAllTheSame) {
  ServoConfig config = watching(Error::kOverVoltage, {true, 32.0, 1.0, 0.0});
  config.quirks.dialect.all_error_bits = false;
  Host host(config);
  host.bus.apply({1, SupplyVoltage{33.0, 0ns}});
  host.wait(20ms);
  host.bus.apply({1, SupplyVoltage{24.0, 0ns}});
  host.wait(20ms);
  EXPECT_EQ(host.ask("141#9A00000000000000").data[7], 0U);
  EXPECT_EQ(host.bus.telemetry(1).errors, model::bit(Error::kOverVoltage));
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(host.run_state(), RunState::kOff);
  host.ask("141#8800000000000000");
  host.ask("141#A100000064000000");
  host.wait(1ms);
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(host.ask("141#9B00000000000000").data[7], 0U);
  host.ask("141#8800000000000000");
  host.wait(1ms);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
}

}  // namespace protection_test
}  // namespace lk::emulator
