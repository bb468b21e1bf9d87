// Encoder and current converter: readings of the firmware (docs/internals/model.md §7).
#include "model/plant/sensors.hpp"

#include "model/control/current_loop_params.hpp"
#include "model/control/motion_loops.hpp"
#include "model/plant/thermal.hpp"
#include "tests/model/support.hpp"

namespace lk::model::test {
namespace sensors_test {

double counts(const DriveParams& d, double theta, double omega = 0.0) {
  std::uint64_t noise = 1;
  return encoder(plant_params(d), theta, omega, noise);
}

TEST(Encoder, CountsAreTheFloorOfTheAngleInItsBits) {
  for (const int bits : {10, 12, 14, 18}) {
    DriveParams d = ideal_drive();
    d.encoder.bits = bits;
    const double per_turn = std::pow(2.0, bits);
    for (double turn = -2.3; turn < 2.3; turn += 0.0137) {
      EXPECT_EQ(counts(d, turn * 2.0 * kPiT), std::floor(turn * per_turn)) << bits << ' ' << turn;
    }
  }
}

TEST(Encoder, AppliesOffsetAndDirection) {
  DriveParams d = ideal_drive();
  d.encoder.bits = 14;
  d.encoder.offset = kPiT / 2;  // a quarter turn: 4096 counts
  EXPECT_EQ(counts(d, 1e-6), 4096.0);
  EXPECT_EQ(counts(d, kPiT / 4 + 1e-6), 4096.0 + 2048.0);
  d.encoder.direction = -1;
  EXPECT_EQ(counts(d, -1e-6), 4096.0);
  EXPECT_EQ(counts(d, kPiT / 4 - 1e-6), 4096.0 - 2048.0);
}

TEST(Encoder, FirmwareRemovesOffsetAndDirection) {
  for (const int direction : {1, -1}) {
    DriveParams d = ideal_drive();
    d.encoder.offset = 1.234;
    d.encoder.direction = direction;
    const CurrentLoopParams<double> p = current_loop_params(d, unlimited());
    for (double theta = -7.0; theta < 7.0; theta += 0.1) {
      const double seen = counts(d, theta) * p.rad_e_per_count - p.rad_e_offset;
      const double half_count = 0.5 * 2.0 * kPiT / (1 << 18);
      EXPECT_NEAR(seen, d.motor.pole_pairs * theta, d.motor.pole_pairs * 1.01 * half_count);
    }
  }
}

TEST(Encoder, NonLinearityHasOnlyItsTwoHarmonics) {
  DriveParams d = ideal_drive();
  d.encoder.inl_1 = 2e-3;
  d.encoder.inl_1_phase = 0.7;
  d.encoder.inl_2 = 1e-3;
  d.encoder.inl_2_phase = 1.9;
  const PlantParams<double> p = plant_params(d);
  constexpr int kPoints = 64;
  for (int harmonic = 0; harmonic <= 6; ++harmonic) {
    double sine_part = 0.0;
    double cosine_part = 0.0;
    for (int n = 0; n < kPoints; ++n) {
      const double theta = 2.0 * kPiT * n / kPoints;
      sine_part += 2.0 / kPoints * non_linearity(p, theta) * std::sin(harmonic * theta);
      cosine_part += 2.0 / kPoints * non_linearity(p, theta) * std::cos(harmonic * theta);
    }
    // a·sin(h·θ + φ) = a·cos φ·sin hθ + a·sin φ·cos hθ
    const double a = harmonic == 1 ? 2e-3 : harmonic == 2 ? 1e-3 : 0.0;
    const double phase = harmonic == 1 ? 0.7 : 1.9;
    // 2 mrad with the accuracy of the model's sine, 2e-9.
    EXPECT_NEAR(sine_part, a * std::cos(phase), 4e-12) << harmonic;
    EXPECT_NEAR(cosine_part, a * std::sin(phase), 4e-12) << harmonic;
  }
}

TEST(Encoder, LatencyDelaysTheReading) {
  DriveParams d = ideal_drive();
  d.encoder.latency = 100e-6;
  // 100 rad/s · 100 µs = 10 mrad = 417.2 counts of 18 bits.
  EXPECT_NEAR(counts(d, 1.0) - counts(d, 1.0, 100.0), 0.01 * (1 << 18) / (2.0 * kPiT), 1.0);
  EXPECT_NEAR(counts(d, 1.0) - counts(d, 1.0, -100.0), -0.01 * (1 << 18) / (2.0 * kPiT), 1.0);
}

/// Expects samples with this mean and deviation, within five standard errors.
template <class Sample>
void expect_spread(double mean, double deviation, Sample sample) {
  constexpr int kCount = 200000;
  double sum = 0;
  double square = 0;
  for (int n = 0; n < kCount; ++n) {
    const double x = sample();
    sum += x;
    square += x * x;
  }
  EXPECT_NEAR(sum / kCount, mean, 5.0 * deviation / std::sqrt(kCount));
  EXPECT_NEAR(std::sqrt(square / kCount - sum / kCount * sum / kCount), deviation,
              deviation * 5.0 * std::sqrt(1.7 / kCount) / 2.0);
}

TEST(Encoder, NoiseHasItsDeviation) {
  DriveParams d = ideal_drive();
  d.encoder.noise = 1e-3;
  const PlantParams<double> p = plant_params(d);
  std::uint64_t noise = noise_seed(5);
  // floor() subtracts half a count on average.
  expect_spread(-0.5 / p.counts_per_rad, 1e-3,
                [&] { return encoder(p, 1.0, 0.0, noise) / p.counts_per_rad - 1.0; });
}

double adc(const DriveParams& d, double i, double gain = 1.0, double offset = 0.0) {
  std::uint64_t noise = 1;
  return current_channel(plant_params(d), i, gain, offset, noise);
}

TEST(CurrentSensor, RoundsToItsStepAndSaturates) {
  DriveParams d = ideal_drive();
  d.current_sensor.range = 33.0;
  d.current_sensor.bits = 12;
  const double lsb = 66.0 / 4096.0;
  for (double i = -32.0; i < 32.0; i += 0.0173) {
    const double seen = adc(d, i);
    EXPECT_LE(std::abs(seen - i), 0.5 * lsb * (1 + 1e-9));
    EXPECT_NEAR(seen / lsb, std::round(seen / lsb), 1e-9);
  }
  EXPECT_EQ(adc(d, 40.0), 33.0);
  EXPECT_EQ(adc(d, -1e6), -33.0);
}

TEST(CurrentSensor, AppliesGainThenOffset) {
  DriveParams d = ideal_drive();  // 20 bits over ±33 A: steps of 63 µA
  EXPECT_NEAR(adc(d, 10.0, 1.02, -0.3), 9.9, 4e-5);
  EXPECT_NEAR(adc(d, -10.0, 1.02, -0.3), -10.5, 4e-5);
}

TEST(CurrentSensor, NoiseHasItsDeviation) {
  DriveParams d = ideal_drive();
  d.current_sensor.noise = 0.05;
  const PlantParams<double> p = plant_params(d);
  std::uint64_t noise = noise_seed(6);
  expect_spread(0.0, 0.05, [&] { return current_channel(p, 0.0, 1.0, 0.0, noise); });
}

TEST(SlowSensors, MotorTemperatureIncludesABoardShare) {
  std::uint64_t noise = 1;
  const SlowSensorParams p{.temp_lsb = 0.5, .board_share = 0.5};
  // 60 °C plus half of the 10 K by which the board exceeds the housing.
  EXPECT_NEAR(measure_slowly(slow_sensors(p), 24.0, {60.0, 35.0, 45.0}, noise).temp_motor, 65.0,
              1e-12);
}

TEST(SlowSensors, RoundVoltageAndTemperaturesToTheirSteps) {
  std::uint64_t noise = 1;
  const SlowSensorParams p{.v_lsb = 0.1, .v_noise = 0.0, .temp_lsb = 0.5};
  const SlowMeasurement m = measure_slowly(slow_sensors(p), 23.96, {40.3, 30.0, 61.74}, noise);
  EXPECT_NEAR(m.v_bus, 24.0, 1e-12);
  EXPECT_NEAR(m.temp_motor, 40.5, 1e-12);
  EXPECT_NEAR(m.temp_driver, 61.5, 1e-12);
}

}  // namespace sensors_test
}  // namespace lk::model::test
