/// @file A log that the emulator has no part in: a joint like that of the FINGER log
/// (docs/fidelity.md), computed here with equations of its own, so that a mistake which the
/// emulator and identify share would show.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "emulator/config/candump_log.hpp"
#include "emulator/core/generation.hpp"
#include "protocol/codec.hpp"
#include "tests/support/profile.hpp"
#include "tools/identify/identified.hpp"

namespace lk::test {
namespace {

/// SI, at the rotor.
struct Joint {
  static constexpr double kT = 0.062;          // Nm/A
  static constexpr double kInertia = 5.4e-5;   // rotor and arm
  static constexpr double kFriction = 0.0124;  // Nm: 12.4 LSB of 33/2048 A
  static constexpr double kCogging = 0.006;    // Nm, 28 times a turn
  static constexpr double kAngleKp = 120;      // 1/s
  static constexpr double kStep_s = 5e-5;
  double angle = 0.3, speed = 0, current = 0, integral = 0;

  /// P on the angle, PI on the speed, a first-order current: half a step of nothing finer.
  void step(double target, double limit, double noise) {
    const double wanted = std::fmax(-limit, std::fmin(limit, kAngleKp * (target - angle)));
    const double error = wanted - speed + noise;
    integral = std::fmax(-5.0, std::fmin(5.0, integral + 8 * error * kStep_s));
    const double asked = std::fmax(-16.0, std::fmin(16.0, 0.25 * error + integral));
    current += (asked - current) * kStep_s / 2e-4;
    const double pushed = kT * current - kCogging * std::sin(28 * angle + 0.7);
    if (speed == 0 && std::fabs(pushed) <= kFriction) return;
    const double against =
        speed != 0 ? std::copysign(kFriction, speed) : std::copysign(kFriction, pushed);
    const double next = speed + (pushed - against) / kInertia * kStep_s;
    speed = speed * next < 0 ? 0 : next;
    angle += speed * kStep_s;
  }
};

/// 60 s of moves of two turns at 573 dps, a 0xA4 every 12 ms.
std::string finger_log(const protocol::WireFormat& format) {
  std::mt19937 random(7);
  const auto noise = [&random](double deviation) {
    double sum = -6;
    for (int n = 0; n < 12; ++n)
      sum += static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
    return deviation * sum;
  };
  constexpr double kDeg = 57.29577951308232;
  Joint joint;
  std::string log;
  for (int n = 0; n < 5000; ++n) {
    const double target = n / 140 % 2 == 0 ? 0.3 : 0.3 + 12.566;
    const auto at = std::chrono::microseconds(12000LL * n + 1'000'000);
    const auto query = protocol::encode_query(
        1,
        protocol::Position2{
            .max_speed_dps = 573,
            .target_cdeg = static_cast<std::int32_t>(std::lround(target * kDeg * 100))},
        format);
    protocol::State2 state;
    state.command = query.data[0] == 0xA4 ? protocol::Position2::kOpcode : state.command;
    state.temperature_C = 33;
    state.iq_A = joint.current + noise(0.06);
    state.speed_dps = std::round(joint.speed * kDeg + noise(2));
    // 65536 counts a turn of the output, which is ten of the rotor.
    const double turns = (joint.angle * kDeg + noise(0.005)) / 3600;
    state.encoder_counts =
        static_cast<std::uint16_t>(std::llround((turns - std::floor(turns)) * 65536) % 65536);
    log += emulator::candump_line(at, "can0", query) + "\n" +
           emulator::candump_line(at + std::chrono::microseconds(350), "can0",
                                  protocol::encode_reply(1, state, format)) +
           "\n";
    for (int k = 0; k < 240; ++k) joint.step(target, 573 / kDeg, noise(0.3));
  }
  return log;
}

TEST(OtherHand, IsIdentifiedAsFarAsItsLogGoes) {
  const auto base = profile("mg4005-14p");
  const auto format = protocol::wire_format(
      emulator::quirks_of(emulator::Generation::kLegacy).dialect, base.series);
  auto tracks =
      emulator::read_tracks(finger_log(format), {.base = base, .generation = "legacy", .id = {}});
  ASSERT_EQ(tracks.size(), 1U);
  EXPECT_NEAR(tracks[0].median_step_s, 0.012, 1e-6);
  const auto drive = emulator::identify(std::move(tracks.front()));
  ASSERT_TRUE(drive.balance);
  const auto& fit = *drive.balance;
  EXPECT_NEAR(fit.coulomb_A.value, Joint::kFriction / Joint::kT, fit.coulomb_A.half_width);
  EXPECT_TRUE(emulator::is_told(fit.coulomb_A));
  ASSERT_TRUE(drive.cogging() != nullptr);
  EXPECT_EQ(drive.cogging()->order, 28);
  ASSERT_FALSE(fit.cogging.empty());
  EXPECT_NEAR(fit.cogging[0].amplitude_A.value, Joint::kCogging / Joint::kT,
              fit.cogging[0].amplitude_A.half_width);
  EXPECT_LE(fit.check.held_out_ratio, 1.2);
  // 12 ms are too long for the inertia.
  EXPECT_FALSE(emulator::is_told(fit.inertia_A_s2));
  for (const auto& one : drive.values) {
    const bool told = one.estimate && emulator::is_told(*one.estimate);
    EXPECT_FALSE(told && one.quantity->key == "k_t_Nm_A");
    if (told && one.quantity->key == "angle_kp_per_s") {
      EXPECT_NEAR(one.estimate->value, Joint::kAngleKp, one.estimate->half_width);
    }
  }
}

/// An MS drive reports power: what that says of its mechanics nobody knows.
TEST(OtherHand, IsNotMadeUpForADriveWithoutCurrent) {
  const auto base = profile("ms4015");
  const auto format =
      protocol::wire_format(emulator::quirks_of(emulator::Generation::kV235).dialect, base.series);
  auto tracks =
      emulator::read_tracks(finger_log(format), {.base = base, .generation = "v235", .id = {}});
  ASSERT_EQ(tracks.size(), 1U);
  const auto drive = emulator::identify(std::move(tracks.front()));
  for (const auto& one : drive.values) EXPECT_FALSE(one.estimate) << one.quantity->key;
}

}  // namespace
}  // namespace lk::test
