// Every sensor fault, by readings of a host and true values.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace fault_sensors_test {

using model::Error;
using namespace std::chrono_literals;
using test::clear;
using test::evidence;
using test::expect_shown;
using test::Host;
using test::inject;
using test::statistics;

constexpr double kCounts_deg = 16384.0 / 360.0;

/// At 45 degrees, count 2048, with the bridge off, so that measurements move nothing.
Host undriven() {
  Host host(test::servo_config(1));
  host.ask("141#8000000000000000");
  return host;
}

double encoder(Host& host) { return host.state_2().encoder_counts; }
double true_counts(Host& host) {
  return host.bus.truth(1).theta_m / (2 * std::numbers::pi) * 16384.0;
}
void turn(Host& host, double turn_deg) {
  host.bus.apply({1, TurnShaft{turn_deg}});
  host.wait(1ms);
}

constexpr double kLsb_A = 1.0 / 64;  // of 0x9D
enum Channel { kA, kB, kBoth };
enum Sensor { kMotor, kDriver };

protocol::State1 state_1(Host& host) { return host.get<protocol::State1>(protocol::ReadState1{}); }
protocol::State3 currents(Host& host) { return host.get<protocol::State3>(protocol::ReadState3{}); }
double angle_cdeg(Host& host) { return static_cast<double>(host.multi_turn_cdeg()); }

/// A reading of the undriven drive; its healthy value and its tolerance.
struct Reading {
  double (*read)(Host&);
  double healthy;
  double tolerance;
};
const Reading kEncoder{encoder, 2048, 1};
const Reading kAngle_cdeg{angle_cdeg, 4500, 3};
const Reading kPhaseA_A{[](Host& host) { return currents(host).i_a_A; }, 0, 2 * kLsb_A};
const Reading kPhaseB_A{[](Host& host) { return currents(host).i_b_A; }, 0, 2 * kLsb_A};
const Reading kPhaseC_A{[](Host& host) { return currents(host).i_c_A; }, 0, 4 * kLsb_A};
const Reading kMotor_C{[](Host& host) { return state_1(host).temperature_C + 0.0; }, 25, 0};
const Reading kDriver_C{[](Host& host) { return host.bus.telemetry(1).temp_driver + 0.0; }, 25, 0};
const Reading kVoltage_V{[](Host& host) { return state_1(host).voltage_V; }, 24, 0.1};
const Reading kTrueVoltage_V{[](Host& host) { return host.bus.truth(1).v_bus; }, 24, 0.1};

TEST(SensorFaults, ChangeReadingsWhileTheyLast) {
  struct Row {
    const char* kind;
    std::vector<FaultValue> values;
    std::vector<std::pair<Reading, double>> readings;
  };
  const Row rows[] = {
      {"encoder_jump", {10}, {{kEncoder, 2048 + 10 * kCounts_deg}, {kAngle_cdeg, 5500}}},
      {"current_offset", {2, kA}, {{kPhaseA_A, 2}, {kPhaseB_A, 0}, {kPhaseC_A, -2}}},
      {"current_offset", {-1, kBoth}, {{kPhaseA_A, -1}, {kPhaseB_A, -1}, {kPhaseC_A, 2}}},
      {"current_stuck", {3, kB}, {{kPhaseA_A, 0}, {kPhaseB_A, 3}, {kPhaseC_A, -3}}},
      {"temperature_stuck", {90, kDriver}, {{kMotor_C, 25}, {kDriver_C, 90}}},
      {"temperature_off", {-40, kMotor}, {{kMotor_C, -15}, {kDriver_C, 25}}},
      {"temperature_off", {15, kDriver}, {{kMotor_C, 25}, {kDriver_C, 40}}},
      {"voltage_off", {3}, {{kVoltage_V, 27}, {kTrueVoltage_V, 24}}},
  };
  for (const Row& row : rows) {
    SCOPED_TRACE(row.kind);
    Host host = undriven();
    Fault made = test::fault(row.kind, {}, {.duration = 10ms});
    std::ranges::copy(row.values, made.values.begin());
    host.bus.apply({kWholeBus, SetFault{made}});
    host.wait(5ms);
    for (const auto& [reading, faulty] : row.readings) {
      EXPECT_NEAR(reading.read(host), faulty, reading.tolerance);
    }
    host.wait(10ms);
    for (const auto& [reading, faulty] : row.readings) {
      EXPECT_NEAR(reading.read(host), reading.healthy, reading.tolerance);
    }
    expect_shown(evidence(host), 0ms, 9);
  }
}

TEST(EncoderFaults, StuckKeepsTheAngle) {
  Host host = undriven();
  inject(host, "encoder_stuck");
  host.wait(10ms);
  EXPECT_FALSE(evidence(host).first_effect_at);
  turn(host, 30);
  EXPECT_EQ(encoder(host), 2048);
  EXPECT_EQ(host.multi_turn_cdeg(), 4500);
  host.wait(10ms);
  expect_shown(evidence(host), 10ms, 10);
  clear(host);
  host.wait(1ms);
  EXPECT_NEAR(encoder(host), 2048 + 30 * kCounts_deg, 1.0);
}

TEST(EncoderFaults, DriftTurnsTheReading) {
  Host host = undriven();
  inject(host, "encoder_drift", {36}, {.duration = 1500ms});
  const double rotor = true_counts(host);
  host.wait(1s);
  EXPECT_NEAR(encoder(host), 2048 + 36 * kCounts_deg, 3.0);  // advances once a millisecond
  EXPECT_EQ(true_counts(host), rotor);
  EXPECT_NEAR(host.state_2().speed_dps, 36.0, 10.0);
  host.wait(1s);
  EXPECT_NEAR(encoder(host), 2048, 1.0);
  expect_shown(evidence(host), 0ms, 1000);
}

TEST(EncoderFaults, NoiseHasItsDeviation) {
  Host host = undriven();
  inject(host, "encoder_noise", {1});
  // With 2000 samples the deviation has an error of 1.6 %.
  const auto [mean, deviation] = statistics(host, 2000, [&] { return encoder(host); });
  EXPECT_NEAR(deviation, kCounts_deg, 0.06 * kCounts_deg);
  EXPECT_NEAR(mean, 2048, 4 * kCounts_deg / std::sqrt(2000.0));
  expect_shown(evidence(host), 0ms, 2000);
  clear(host);
  const auto [after, rest] = statistics(host, 100, [&] { return encoder(host); });
  EXPECT_EQ(after, 2048);
  EXPECT_EQ(rest, 0);
}

TEST(EncoderFaults, GarbageIsUniform) {
  Host host = undriven();
  inject(host, "encoder_garbage");
  double least = 16384;
  double most = 0;
  const auto [mean, deviation] = statistics(host, 1000, [&] {
    const double value = encoder(host);
    least = std::min(least, value);
    most = std::max(most, value);
    return value;
  });
  // Uniform over the turn: deviation turn/√12. With 1000 samples errors are about 3 %.
  EXPECT_NEAR(mean, 8192, 4 * 4730 / std::sqrt(1000.0));
  EXPECT_NEAR(deviation, 4730, 0.1 * 4730);
  EXPECT_LT(least, 164);
  EXPECT_GT(most, 16220);
  expect_shown(evidence(host), 0ms, 900);
  clear(host);
  host.wait(1ms);
  EXPECT_EQ(encoder(host), 2048);
}

TEST(EncoderFaults, LostMagnetLeavesNoiseNearTheLastAngle) {
  Host host = undriven();
  turn(host, 135);  // to the middle of the turn
  inject(host, "encoder_lost_magnet");
  turn(host, 170);
  const auto [mean, deviation] = statistics(host, 1000, [&] { return encoder(host); });
  // Near the last angle, not the true one; with the noise of stray fields (docs/internals/model.md
  // §14).
  EXPECT_NEAR(mean, 8192, 0.2 * 16384);
  EXPECT_GT(deviation, 0.01 * 16384);
  expect_shown(evidence(host), 1ms, 900);
  clear(host);
  host.wait(1ms);
  EXPECT_NEAR(encoder(host), 2048 + (135 + 170) * kCounts_deg, 2.0);
}

TEST(EncoderFaults, SlowDelaysTheReading) {
  Host host(test::servo_config(1));
  inject(host, "encoder_slow", {10});
  host.wait(10ms);
  EXPECT_FALSE(evidence(host).first_effect_at);  // no motion
  clear(host);
  host.get<protocol::State2>(protocol::Speed{360, 0});
  host.wait(500ms);
  host.ask("141#8000000000000000");  // coasts without friction
  inject(host, "encoder_slow", {10});
  host.wait(50ms);
  // It shows the rotor's angle of 10 ms ago: 3.6 degrees.
  const double lag = std::remainder(true_counts(host) - encoder(host), 16384.0);
  EXPECT_NEAR(lag, 3.6 * kCounts_deg, 3.0);
  expect_shown(evidence(host, 1), 510ms, 45);
  clear(host);
  host.wait(1ms);
  EXPECT_NEAR(std::remainder(true_counts(host) - encoder(host), 16384.0), 0.0, 2.0);
}

// --- current

TEST(CurrentFaults, GainMakesTheLoopDriveAnotherCurrent) {
  ServoConfig config = test::servo_config(1);
  config.profile.drive.load.J = 1;  // hardly moves
  Host host(config);
  inject(host, "current_gain", {0.5, kBoth});
  host.wait(10ms);
  EXPECT_FALSE(evidence(host).first_effect_at);  // half of zero
  host.get<protocol::State2>(protocol::Torque{3.2});
  host.wait(20ms);
  EXPECT_NEAR(host.state_2().iq_A, 3.2, 0.05);
  EXPECT_NEAR(host.bus.truth(1).i_q, 6.4, 0.1);
  expect_shown(evidence(host), 10ms, 15);
  clear(host);
  host.wait(20ms);
  EXPECT_NEAR(host.bus.truth(1).i_q, 3.2, 0.05);
}

TEST(CurrentFaults, NoiseHasItsDeviation) {
  Host host = undriven();
  inject(host, "current_noise", {0.5});
  const auto [mean, deviation] = statistics(host, 2000, [&] { return currents(host).i_b_A; });
  EXPECT_NEAR(deviation, 0.5, 0.03);  // error 1.6 %
  EXPECT_NEAR(mean, 0.0, 0.05);
  expect_shown(evidence(host), 0ms, 2000);
  clear(host);
  host.wait(1ms);
  EXPECT_NEAR(currents(host).i_b_A, 0, 2 * kLsb_A);
}

TEST(CurrentFaults, StuckAtOverCurrentTripsTheProtection) {
  ServoConfig config = test::servo_config(1);
  config.quirks.dialect.all_error_bits = true;
  config.rom.protections[static_cast<std::size_t>(Error::kOverCurrent)] = {true, 20, 1, 0.001};
  Host host(config);
  inject(host, "current_stuck", {25, kA}, {.duration = 20ms});
  host.wait(10ms);
  EXPECT_EQ(host.get<protocol::State1>(protocol::ReadState1{}).errors,
            model::bit(Error::kOverCurrent));
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
}

// --- temperature and voltage

TEST(SlowSensorFaults, StuckTemperatureTripsTheProtectionOfAColdMotor) {
  ServoConfig config = test::servo_config(1);
  config.rom.protections[static_cast<std::size_t>(Error::kMotorTemperature)] = {true, 100, 10, 0};
  Host host(config);
  inject(host, "temperature_stuck", {120, kMotor}, {.duration = 100ms});
  host.wait(10ms);
  EXPECT_EQ(state_1(host).temperature_C, 120);
  EXPECT_EQ(state_1(host).errors, model::bit(Error::kMotorTemperature));
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
  EXPECT_NEAR(host.bus.truth(1).temp_winding, 25, 0.1);
  EXPECT_EQ(host.get<protocol::State1>(protocol::ClearErrors{}).errors, 8U);  // still active
  host.wait(100ms);
  EXPECT_EQ(state_1(host).temperature_C, 25);
  EXPECT_EQ(host.get<protocol::State1>(protocol::ClearErrors{}).errors, 0U);
  expect_shown(evidence(host), 0ms, 99);
}

TEST(SlowSensorFaults, StuckVoltageTripsUnderVoltageWithoutAReset) {
  ServoConfig config = test::powered_drive();
  config.rom.protections[0] = {true, 18.0, 1.0, 0.002};
  Host host(config);
  inject(host, "voltage_stuck", {4}, {.duration = 100ms});  // the reset threshold is 5 V
  host.wait(10ms);
  EXPECT_EQ(state_1(host).voltage_V, 4.0);
  EXPECT_EQ(state_1(host).errors, model::bit(Error::kUnderVoltage));
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
  EXPECT_TRUE(host.bus.telemetry(1).alive);
  EXPECT_NEAR(host.bus.truth(1).v_bus, 24.0, 0.1);
  host.wait(100ms);
  EXPECT_NEAR(state_1(host).voltage_V, 24.0, 0.1);
  EXPECT_EQ(host.get<protocol::State1>(protocol::ClearErrors{}).errors, 0U);
  expect_shown(evidence(host), 0ms, 99);
}

}  // namespace fault_sensors_test
}  // namespace lk::emulator
