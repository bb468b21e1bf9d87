// Faulty sensors and a wrong clock: sensor readings and the firmware's reaction
// (docs/internals/model.md §14).
#include "tests/fidelity/statistics.hpp"
#include "tests/model/support.hpp"

namespace lk::model::test {
namespace sensor_faults_test {

using lk::test::deviation;
using lk::test::mean;

constexpr double kCounts14 = 16384.0;

double counts_per_rad(const DriveParams& d) { return (1 << d.encoder.bits) / (2.0 * kPiT); }

/// A drive with its bridge off and a shaft that turns at constant `omega` rad/s.
DriveBank coasting(const DriveParams& d, double omega) {
  DriveBank bank = one_drive(d);
  bank.command(0, Off{});
  bank.advance(8);  // the setpoint is in effect
  bank.kick(0, omega * d.mechanics.J);
  return bank;
}

/// Returns `n` readings of the encoder, some ticks apart.
std::vector<double> shown(DriveBank& bank, int n) {
  std::vector<double> result;
  for (int k = 0; k < n; ++k) {
    bank.advance(3);
    result.push_back(static_cast<double>(bank.telemetry(0).encoder_position));
  }
  return result;
}

TEST(EncoderFault, StuckEncoderKeepsItsReading) {
  const DriveParams d = ideal_drive();
  DriveBank bank = coasting(d, 30.0);
  bank.advance(1000);
  const std::int64_t held = bank.telemetry(0).encoder_position;
  const double before = bank.truth(0).theta_m;
  bank.set_faults(0, {.encoder = EncoderFault::kStuck});
  for (int n = 0; n < 500; ++n) {
    bank.advance(7);
    ASSERT_EQ(bank.telemetry(0).encoder_position, held);
  }
  EXPECT_NEAR(bank.truth(0).theta_m - before, 30.0 * 3500 / d.inverter.f_pwm, 1e-6);
  EXPECT_LT(std::abs(bank.telemetry(0).omega), 1e-3);

  bank.set_faults(0, {});
  bank.advance(8);
  // A sample is one period old.
  EXPECT_NEAR(static_cast<double>(bank.telemetry(0).encoder_position),
              bank.truth(0).theta_m * counts_per_rad(d),
              30.0 / d.inverter.f_pwm * counts_per_rad(d) + 1.0);
  // The speed of the jump is not measured: the estimate returns from zero, without an overshoot
  // towards 3 rad in a period.
  for (int n = 0; n < 300; ++n) {
    bank.advance(4);
    ASSERT_LT(std::abs(bank.telemetry(0).omega), 45.0);
  }
  EXPECT_NEAR(bank.telemetry(0).omega, 30.0, 0.1);
}

TEST(EncoderFault, GarbageIsUniformOverTheTurn) {
  DriveParams d = ideal_drive();
  d.encoder.bits = 14;
  DriveBank bank = coasting(d, 0.0);
  bank.set_faults(0, {.encoder = EncoderFault::kGarbage});
  const std::vector<double> samples = shown(bank, 4000);
  for (const double count : samples) {
    ASSERT_GE(count, 0.0);
    ASSERT_LT(count, kCounts14);
  }
  // Uniform distribution: mean 1/2, deviation 1/√12 of a turn; tolerances are five standard errors
  // of 4000 samples.
  EXPECT_NEAR(mean(samples), 0.5 * kCounts14, 5.0 * kCounts14 / std::sqrt(12.0 * 4000));
  EXPECT_NEAR(deviation(samples), kCounts14 / std::sqrt(12.0), 0.02 * kCounts14);
  EXPECT_EQ(bank.truth(0).theta_m, 0.0);
}

TEST(EncoderFault, LostMagnetGivesNoiseAndDrift) {
  DriveParams d = ideal_drive();
  d.encoder.bits = 14;
  DriveBank bank = coasting(d, 0.0);
  bank.turn_shaft(0, 2.0);
  bank.advance(4);
  const auto before = static_cast<double>(bank.telemetry(0).encoder_position);
  bank.set_faults(0, {.encoder = EncoderFault::kLostMagnet});
  const std::vector<double> samples = shown(bank, 20000);
  // 0.02 turns of noise added to 0.1 turns of drift (lane_faults.cpp).
  EXPECT_NEAR(deviation(samples), 0.1 * kCounts14, 0.05 * kCounts14);
  EXPECT_NEAR(mean(samples), before, 0.1 * kCounts14);
  std::vector<double> steps;
  for (std::size_t n = 1; n < samples.size(); ++n) {
    steps.push_back(samples[n] - samples[n - 1]);
  }
  EXPECT_NEAR(deviation(steps), 0.02 * std::sqrt(2.0) * kCounts14, 0.002 * kCounts14);
}

TEST(EncoderFault, OffsetLatencyAndNoiseAddToTheDrives) {
  DriveParams d = ideal_drive();
  d.encoder.bits = 14;
  DriveBank still = coasting(d, 0.0);
  still.set_faults(0, {.encoder_offset = 0.25});
  still.advance(4);
  EXPECT_EQ(still.telemetry(0).encoder_position, std::floor(0.25 * counts_per_rad(d)));

  d.encoder.noise = 3.0 / counts_per_rad(d);
  DriveBank noisy = coasting(d, 0.0);
  noisy.set_faults(0, {.encoder_noise = 4.0 / counts_per_rad(d)});
  // 3 and 4 counts give 5, and rounding 1/√12; tolerance: five standard errors of 4000 samples.
  EXPECT_NEAR(deviation(shown(noisy, 4000)), std::sqrt(25.0 + 1.0 / 12),
              5.0 * 5.0 / std::sqrt(8000.0));

  d.encoder.noise = 0.0;
  d.encoder.bits = 18;
  DriveBank healthy = coasting(d, 40.0);
  DriveBank slow = healthy;
  slow.set_faults(0, {.encoder_latency = 1e-3});
  healthy.advance(1000);
  slow.advance(1000);
  EXPECT_NEAR(static_cast<double>(healthy.telemetry(0).encoder_position -
                                  slow.telemetry(0).encoder_position),
              40.0 * 1e-3 * counts_per_rad(d), 1.01);
}

/// A locked shaft at `theta_m`, so that only the loop changes the currents.
DriveBank locked(const DriveParams& d, Faults faults, const Setpoint& setpoint) {
  DriveBank bank = one_drive(d);
  faults.jam = 1.0;
  bank.set_faults(0, faults);
  bank.command(0, setpoint);
  bank.advance(ticks_in(d, 0.05));
  return bank;
}

TEST(CurrentFault, HalfTheGainDoublesTheCurrent) {
  const DriveParams d = ideal_drive();
  const DriveBank bank =
      locked(d, {.current_a = {.gain = 0.5}, .current_b = {.gain = 0.5}}, Torque{4.0});
  EXPECT_NEAR(bank.telemetry(0).i_q, 4.0, 0.01);
  EXPECT_NEAR(bank.truth(0).i_q, 8.0, 0.02);
}

TEST(CurrentFault, LoopHidesAnOffset) {
  const DriveParams d = ideal_drive();
  const DriveBank bank = locked(d, {.current_a = {.offset = 1.5}}, Torque{0.0});
  EXPECT_NEAR(bank.telemetry(0).i_a, 0.0, 0.01);
  // At rotor angle 0 the d axis is phase a.
  EXPECT_NEAR(bank.truth(0).i_d, -1.5, 0.01);
}

TEST(CurrentFault, ShowsStuckChannelAndNoise) {
  DriveParams d = ideal_drive();
  DriveBank bank = coasting(d, 0.0);
  bank.set_faults(0, {.current_a = {.stuck = 2.5}, .current_noise = 0.3});
  double sum = 0.0;
  for (int n = 0; n < 4000; ++n) {
    bank.advance(1);
    ASSERT_NEAR(bank.telemetry(0).i_a, 2.5, 1e-4);
    sum += bank.telemetry(0).i_b * bank.telemetry(0).i_b;
  }
  EXPECT_NEAR(std::sqrt(sum / 4000), 0.3, 5.0 * 0.3 / std::sqrt(8000.0));

  d.control.has_current_loop = false;  // without this sensor
  DriveBank ms = coasting(d, 0.0);
  ms.set_faults(0, {.current_a = {.offset = 1.0, .stuck = 2.5}, .current_b = {.offset = 1.0}});
  ms.advance(100);
  EXPECT_EQ(ms.telemetry(0).i_a, 0.0);
  EXPECT_EQ(ms.telemetry(0).i_b, 0.0);
}

TEST(SlowSensorFault, LowStuckVoltageTripsUnderVoltage) {
  const DriveParams d = ideal_drive();
  DriveBank bank = one_drive(d, protecting(Error::kUnderVoltage, {true, 12.0, 1.0, 0.01}));
  bank.command(0, Speed{20.0});
  bank.advance(ticks_in(d, 0.1));
  ASSERT_EQ(bank.telemetry(0).errors, 0);
  bank.set_faults(0, {.v_bus_stuck = 3.0});
  bank.advance(ticks_in(d, 0.009));
  EXPECT_EQ(bank.telemetry(0).errors, 0);
  bank.advance(ticks_in(d, 0.002));
  EXPECT_EQ(bank.telemetry(0).errors, bit(Error::kUnderVoltage));
  EXPECT_FALSE(bank.telemetry(0).bridge_on);
  EXPECT_NEAR(bank.telemetry(0).v_bus, 3.0, 1e-4);
  EXPECT_NEAR(bank.truth(0).v_bus, 24.0, 0.1);

  bank.set_faults(0, {});
  bank.advance(8);
  bank.clear_errors(0);
  EXPECT_EQ(bank.telemetry(0).errors, 0);
}

TEST(SlowSensorFault, OffsetsAreShownDownToZeroVolts) {
  DriveParams d = ideal_drive();
  d.slow_sensor.temp_lsb = 0.5;
  DriveBank bank = one_drive(d, protecting(Error::kMotorTemperature, {true, 80.0, 5.0, 0.0}));
  bank.set_faults(0,
                  {.v_bus_offset = -2.5, .temp_motor_offset = 20.2, .temp_driver_offset = -30.0});
  bank.advance(8);
  EXPECT_NEAR(bank.telemetry(0).v_bus, 21.5, 1e-3);
  EXPECT_NEAR(bank.telemetry(0).temp_motor, 45.0, 0.01);  // 45.2 in steps of half a kelvin
  EXPECT_NEAR(bank.telemetry(0).temp_driver, -5.0, 0.01);
  EXPECT_EQ(bank.telemetry(0).errors, 0);
  bank.set_faults(0, {.v_bus_offset = -50.0, .temp_motor_stuck = 90.0});
  bank.advance(8);
  EXPECT_EQ(bank.telemetry(0).v_bus, 0.0);
  EXPECT_EQ(bank.telemetry(0).errors, bit(Error::kMotorTemperature));
  EXPECT_NEAR(bank.truth(0).temp_winding, 25.0, 0.1);
}

TEST(ClockFault, FastClockMakesAFastDrive) {
  const DriveParams d = ideal_drive();
  DriveBank bank = one_drive(d);
  bank.set_faults(0, {.clock_ratio = 1.01});
  bank.command(0, Speed{100.0});
  bank.advance(ticks_in(d, 1.0));
  // 100 rad in one second of its own clock, which is 1/1.01 s.
  EXPECT_NEAR(bank.truth(0).omega_m, 101.0, 0.02);
  EXPECT_NEAR(bank.telemetry(0).omega, 100.0, 0.02);

  ControlSettings ramped = unlimited();
  ramped.accel_max = 100.0;
  for (const double ratio : {1.0, 1.25, 0.8}) {
    DriveBank ramp = one_drive(d, ramped);
    ramp.set_faults(0, {.clock_ratio = ratio});
    ramp.command(0, Speed{1000.0});
    ramp.advance(ticks_in(d, 0.2));
    const double earlier = ramp.truth(0).omega_m;
    ramp.advance(ticks_in(d, 0.2));
    EXPECT_NEAR((ramp.truth(0).omega_m - earlier) / 0.2, 100.0 * ratio * ratio, 0.5) << ratio;
  }
}

TEST(ClockFault, BootTimeFollowsTheDrivesClock) {
  DriveParams d = ideal_drive();
  d.logic.boot_time = 0.05;
  for (const double ratio : {0.5, 1.0, 2.0}) {
    const DriveInit init{d, unlimited(), 1, 0.0, false};
    DriveBank bank({&init, 1});
    bank.set_faults(0, {.clock_ratio = ratio});
    bank.connect_supply(0, true);
    double time = 0.0;
    while (!bank.alive(0) && time < 1.0) {
      bank.advance(4);
      time += 4.0 / d.inverter.f_pwm;
    }
    EXPECT_NEAR(time, 0.05 / ratio, 1e-3) << ratio;
  }
}

}  // namespace sensor_faults_test
}  // namespace lk::model::test
