// Clarke, Park and space-vector PWM: identities and geometry.
#include "model/transforms.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/control/current_loop.hpp"

namespace lk::model {
namespace transforms_test {

constexpr double kRounding = 1e-12;  // a few operations on numbers of order ten

TEST(Transforms, RoundTripsAndAmplitude) {
  for (double theta = -10.0; theta < 10.0; theta += 0.037) {
    const SinCos<double> t{std::sin(theta), std::cos(theta)};
    const Dq<double> x{3.0 * std::cos(0.3 * theta), -2.0 + theta};
    const Dq<double> back = park(clarke(inverse_clarke(inverse_park(x, t))), t);
    EXPECT_NEAR(back.d, x.d, kRounding * 10);
    EXPECT_NEAR(back.q, x.q, kRounding * 10);

    // A current of amplitude 5 on the d axis is 5·cos of the angle to each phase axis.
    const Abc<double> i = inverse_clarke(inverse_park(Dq<double>{5.0, 0.0}, t));
    EXPECT_NEAR(i.a, 5.0 * std::cos(theta), 1e-11);
    EXPECT_NEAR(i.b, 5.0 * std::cos(theta - 2.0 * std::numbers::pi / 3), 1e-11);
    EXPECT_NEAR(i.c, 5.0 * std::cos(theta + 2.0 * std::numbers::pi / 3), 1e-11);
  }
}

TEST(Transforms, PowerIsThreeHalvesOfTheDqProduct) {
  for (double theta = 0.0; theta < 7.0; theta += 0.1) {
    const SinCos<double> t{std::sin(theta), std::cos(theta)};
    const Dq<double> v{4.0, -7.0};
    const Dq<double> i{-1.5, 9.0};
    const Abc<double> v_abc = inverse_clarke(inverse_park(v, t));
    const Abc<double> i_abc = inverse_clarke(inverse_park(i, t));
    const double three_phase = v_abc.a * i_abc.a + v_abc.b * i_abc.b + v_abc.c * i_abc.c;
    EXPECT_NEAR(three_phase, 1.5 * (v.d * i.d + v.q * i.q), 1e-10);
  }
}

TEST(Transforms, CommonModeOfThePhasesCancels) {
  const AlphaBeta<double> bare = clarke(Abc<double>{1.0, 2.0, -3.0});
  const AlphaBeta<double> raised = clarke(Abc<double>{8.0, 9.0, 4.0});
  EXPECT_NEAR(bare.alpha, raised.alpha, kRounding);
  EXPECT_NEAR(bare.beta, raised.beta, kRounding);
}

constexpr double kVBus = 24.0;
constexpr double kFine = 1e9;  // timer counts: negligible rounding

AlphaBeta<double> request(double amplitude, double theta) {
  return {amplitude * std::cos(theta), amplitude * std::sin(theta)};
}

TEST(SpaceVector, LegsGiveTheRequestedVoltage) {
  for (const double amplitude : {0.0, 0.01, 1.0, 8.0, kVBus / std::sqrt(3.0)}) {
    for (double theta = 0.0; theta < 6.3; theta += 0.003) {
      const AlphaBeta<double> v = request(amplitude, theta);
      const Abc<double> duty = svpwm(v, 1.0 / kVBus, kFine, 1.0 / kFine, 1.0);
      const AlphaBeta<double> given = clarke(duty);
      // Rounding by 1/kFine per leg, amplified by at most 4/3.
      EXPECT_NEAR(given.alpha * kVBus, v.alpha, kVBus * 1e-9);
      EXPECT_NEAR(given.beta * kVBus, v.beta, kVBus * 1e-9);
    }
  }
}

TEST(SpaceVector, CommonModeIsTheTriangularThirdHarmonic) {
  const double amplitude = 10.0;
  for (double theta = 0.0; theta < 6.3; theta += 0.003) {
    const Abc<double> duty = svpwm(request(amplitude, theta), 1.0 / kVBus, kFine, 1.0 / kFine, 1.0);
    // −(max + min)/2 of three cosines is half the middle one, with three periods per turn.
    std::array<double, 3> phase{amplitude * std::cos(theta),
                                amplitude * std::cos(theta - 2 * std::numbers::pi / 3),
                                amplitude * std::cos(theta + 2 * std::numbers::pi / 3)};
    std::sort(phase.begin(), phase.end());
    const double common = (duty.a + duty.b + duty.c) / 3.0 - 0.5;
    EXPECT_NEAR(common * kVBus, 0.5 * phase[1], kVBus * 2e-9);
    // Centred: the highest and the lowest leg have equal distances from the rails.
    const double high = std::max({duty.a, duty.b, duty.c});
    const double low = std::min({duty.a, duty.b, duty.c});
    EXPECT_NEAR(high + low, 1.0, 3e-9);
  }
}

TEST(SpaceVector, LinearRangeEndsAtTheInscribedCircle) {
  // At |v| = V/√3 the duties reach the rails in the middle of each sextant and never exceed them.
  double widest = 0.0;
  for (double theta = 0.0; theta < 6.3; theta += 0.001) {
    const Abc<double> duty =
        svpwm(request(kVBus / std::sqrt(3.0), theta), 1.0 / kVBus, kFine, 1.0 / kFine, 2.0);
    widest = std::max({widest, duty.a - 0.5, duty.b - 0.5, duty.c - 0.5});
  }
  EXPECT_NEAR(widest, 0.5, 1e-6);  // the scan's step: 1 − cos(0.0005) = 1.3e-7

  // Above this the clamp limits the voltage: at 30° 10 % more is not delivered, at 0° it is.
  const double more = 1.1 * kVBus / std::sqrt(3.0);
  const auto given = [&](double theta) {
    const AlphaBeta<double> v =
        clarke(svpwm(request(more, theta), 1.0 / kVBus, kFine, 1.0 / kFine, 1.0));
    return kVBus * std::hypot(v.alpha, v.beta);
  };
  EXPECT_NEAR(given(0.0), more, 1e-6);  // towards a corner of the hexagon (2/3·V)
  EXPECT_NEAR(given(std::numbers::pi / 6), kVBus / std::sqrt(3.0), 1e-6);  // a side of the hexagon
}

TEST(SpaceVector, DutiesAreWholeTimerCountsWithinTheirLimits) {
  const double counts = 2625.0;
  const double duty_max = 0.98;
  for (double theta = 0.0; theta < 6.3; theta += 0.0037) {
    for (const double amplitude : {0.3, 5.0, 14.0, 30.0}) {
      const Abc<double> duty =
          svpwm(request(amplitude, theta), 1.0 / kVBus, counts, 1.0 / counts, duty_max);
      const Abc<double> exact =
          svpwm(request(amplitude, theta), 1.0 / kVBus, kFine, 1.0 / kFine, duty_max);
      for (const auto& [coarse, fine] :
           {std::pair{duty.a, exact.a}, {duty.b, exact.b}, {duty.c, exact.c}}) {
        EXPECT_LE(std::abs(coarse - fine), 0.5 / counts + 1e-8);
        EXPECT_GE(coarse, 1.0 - duty_max);
        EXPECT_LE(coarse, duty_max);
        if (coarse > 1.0 - duty_max && coarse < duty_max) {
          EXPECT_NEAR(coarse * counts, std::round(coarse * counts), 1e-9);
        }
      }
    }
  }
}

}  // namespace transforms_test
}  // namespace lk::model
