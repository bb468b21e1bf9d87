#include "emulator/core/servo/shaft_angles.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace lk::emulator {
namespace shaft_angles_test {

Profile profile(int bits, EncoderSpan span = EncoderSpan::kRotorTurn, double gear_ratio = 1) {
  Profile result;
  result.drive.encoder.bits = bits;
  result.drive.mechanics.gear_ratio = gear_ratio;
  result.encoder_span = span;
  return result;
}

TEST(ShaftAngles, OutputTurnIsTheRangeOfItsEncoder) {
  const ShaftAngles angles(profile(18, EncoderSpan::kOutputTurn, 10));
  EXPECT_EQ(angles.raw(10 * (std::int64_t{1} << 18)), 0);  // ten rotor turns are one output turn
  EXPECT_EQ(angles.raw(-1), 65535);
}

TEST(ShaftAngles, WideEncodersShowTheirTopSixteenBits) {
  const ShaftAngles angles(profile(18));
  EXPECT_EQ(angles.max_wire_count(), 65535);
  EXPECT_EQ(angles.raw(3), 0);
  EXPECT_EQ(angles.raw(4), 1);
  EXPECT_EQ(angles.raw((1 << 18) - 1), 65535);
  EXPECT_EQ(angles.raw(-1), 65535);
  EXPECT_EQ(angles.raw(-5), 65534);
}

TEST(ShaftAngles, NarrowEncodersShowAllBits) {
  for (const int bits : {12, 14, 15, 16}) {
    const ShaftAngles angles(profile(bits));
    EXPECT_EQ(angles.max_wire_count(), (1 << bits) - 1);
    EXPECT_EQ(angles.raw(1), 1);
    EXPECT_EQ(angles.raw(-1), (1 << bits) - 1);
  }
}

TEST(ShaftAngles, OffsetWrapsAround) {
  const ShaftAngles angles(profile(14));
  EXPECT_EQ(angles.encoder(10, 11), 16383);
  EXPECT_EQ(angles.encoder(11, 11), 0);
}

// Every count of two turns: 0x94 grows clockwise from 0 to 35999 and restarts, 0x92 continues.
TEST(ShaftAngles, SingleTurnGrowsClockwise) {
  ShaftAngles angles(profile(14));
  angles.set_offset(100);
  angles.forget_turns(100);
  int last_cdeg = -1;
  for (std::int64_t k = 0; k < std::int64_t{2} * 16384; ++k) {
    const auto single_cdeg = static_cast<int>(angles.single_turn_cdeg(100 + k));
    ASSERT_EQ(single_cdeg, std::lround(static_cast<double>(k % 16384) * 36000 / 16384) % 36000);
    if (k % 16384 != 0) {
      ASSERT_GT(single_cdeg, last_cdeg);
    }
    last_cdeg = single_cdeg;
    ASSERT_EQ(angles.multi_turn_cdeg(100 + k) % 36000, single_cdeg);
  }
  EXPECT_EQ(angles.multi_turn_cdeg(100 - 16384), -36000);
  EXPECT_EQ(angles.multi_turn_cdeg(99), -2);  // −2.197
}

TEST(ShaftAngles, LargeTurnCountsAreExact) {
  const ShaftAngles angles(profile(18));
  const std::int64_t turns = std::int64_t{1} << 40;
  EXPECT_EQ(angles.multi_turn_cdeg(turns << 18), turns * 36000);
  EXPECT_EQ(angles.multi_turn_cdeg(-(turns << 18) + (1 << 16)), -turns * 36000 + 9000);
}

TEST(ShaftAngles, CommandHasATheta) {
  const ShaftAngles angles(profile(14));
  EXPECT_DOUBLE_EQ(angles.theta({4096, 9000}), std::numbers::pi);
  EXPECT_DOUBLE_EQ(angles.theta({-16384, -36000}), -4 * std::numbers::pi);
}

TEST(ShaftAngles, BootAngleIsTheConfiguredOne) {
  auto mounted = profile(14);
  mounted.drive.encoder.offset = 1.0;
  for (const int direction : {1, -1}) {
    mounted.drive.encoder.direction = direction;
    ShaftAngles angles(mounted);
    angles.set_offset(3000);
    const double theta_m = angles.theta_m_at(45);
    // The sensor's reading there, converted to count clockwise.
    const double seen_counts = (direction * theta_m + 1.0) * 16384 / (2 * std::numbers::pi);
    model::Telemetry telemetry;
    telemetry.encoder_position = static_cast<std::int64_t>(std::floor(seen_counts));
    EXPECT_NEAR(angles.single_turn_cdeg(angles.position(telemetry)), 4500, 3) << direction;
  }
}

// The shaft's zero is the encoder's: 4096 of 16384 counts are 90°, plus half a count.
TEST(ShaftAngles, ShaftZeroIsTheRawZeroOfTheEncoder) {
  constexpr double kHalfCount_deg = 360.0 / 16384 / 2;
  ShaftAngles angles(profile(14));
  EXPECT_NEAR(angles.theta_m_at(50) * 180 / std::numbers::pi, 50 + kHalfCount_deg, 1e-9);
  angles.set_offset(4096);
  EXPECT_NEAR(angles.theta_m_at(50) * 180 / std::numbers::pi, 140 + kHalfCount_deg, 1e-9);
}

// Targets 0.01° before a full turn, and zero. Up to two counts past the target in the direction of
// travel count as arrived, also across the wrap (docs/reference/protocol.md §4.3).
TEST(ShaftAngles, TargetWithinTwoCountsIsReachedAcrossZero) {
  const ShaftAngles angles(profile(14));
  constexpr std::int64_t kTurns3 = std::int64_t{3} * 16384;
  const auto turns = [&](std::int64_t position, bool clockwise, std::uint32_t target_cdeg) {
    const CommandedPosition target = angles.single_turn_target(position, clockwise, target_cdeg);
    return angles.theta(target) / (2 * std::numbers::pi);
  };
  // The target is at count 16383.54 of the previous turn.
  EXPECT_NEAR(turns(kTurns3, true, 35999), 3 - 1.0 / 36000, 1e-12);
  EXPECT_NEAR(turns(kTurns3 + 1, true, 35999), 3 - 1.0 / 36000, 1e-12);
  EXPECT_NEAR(turns(kTurns3 + 2, true, 35999), 4 - 1.0 / 36000, 1e-12);  // 2.46 counts
  EXPECT_NEAR(turns(kTurns3 - 1, false, 0), 3, 1e-12);
  EXPECT_NEAR(turns(kTurns3 - 2, false, 0), 3, 1e-12);
  EXPECT_NEAR(turns(kTurns3 - 3, false, 0), 2, 1e-12);
  // Without a wrap.
  EXPECT_NEAR(turns(kTurns3 + 8190, false, 18000), 3.5, 1e-12);
  EXPECT_NEAR(turns(kTurns3 + 8189, false, 18000), 2.5, 1e-12);
  EXPECT_NEAR(turns(kTurns3 + 8194, true, 18000), 3.5, 1e-12);
  EXPECT_NEAR(turns(kTurns3 + 8195, true, 18000), 4.5, 1e-12);
}

/// If wire and sensor counts differ (docs/reference/protocol.md §4.3): two wire counts,
/// 2·10·360°/65536 = 0.110° on an MG4005-i10. Or, if larger, the resting error of the position
/// loop, 0.02° (docs/internals/model.md), plus encoder noise.
TEST(ShaftAngles, TargetIsReachedWithinTheRestingError) {
  struct Case {
    const char* what;
    Profile profile;
    double there_deg, not_there_deg;
  };
  Profile noisy = profile(18);
  noisy.drive.encoder.noise = 0.0025 * std::numbers::pi / 180;
  for (const Case& c :
       {Case{"output turn", profile(18, EncoderSpan::kOutputTurn, 10), 0.109, 0.111},
        Case{"rotor turn", profile(18), 0.020, 0.023},
        Case{"noise", noisy, 0.020 + 3.46 * 0.0025, 0.033}}) {
    const ShaftAngles angles(c.profile);
    const double counts_per_deg = (1 << 18) / 360.0;
    for (const bool clockwise : {true, false}) {
      const auto travel_deg = [&](double behind_deg) {
        const double from_deg = 90 + (clockwise ? behind_deg : -behind_deg);
        const auto target =
            angles.single_turn_target(std::llround(from_deg * counts_per_deg), clockwise, 9000);
        return std::abs(angles.theta(target) * 180 / std::numbers::pi - from_deg);
      };
      EXPECT_LT(travel_deg(c.there_deg), 1) << c.what;
      EXPECT_GT(travel_deg(c.not_there_deg), 359) << c.what;
    }
  }
}

/// The wire has (−180°, 180°]: 180.00° must not become −180.00°. 65536·2 counts are half a turn;
/// three more are 0.0041°, four 0.0055°.
TEST(ShaftAngles, HalfATurnIsTheUpperEnd) {
  constexpr std::int64_t kHalfTurn = std::int64_t{1} << 17;
  ShaftAngles angles(profile(18));
  const auto boots_at_cdeg = [&](std::int64_t position) {
    angles.forget_turns(position);
    return angles.multi_turn_cdeg(position);
  };
  EXPECT_EQ(boots_at_cdeg(kHalfTurn), 18000);
  EXPECT_EQ(boots_at_cdeg(kHalfTurn + 3), 18000);
  EXPECT_EQ(boots_at_cdeg(kHalfTurn + 4), -17999);
}

}  // namespace shaft_angles_test
}  // namespace lk::emulator
