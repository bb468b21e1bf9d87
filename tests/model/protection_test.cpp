// Protections: thresholds, delays, hysteresis, latching (docs/internals/model.md §12).
#include "model/control/protection.hpp"

#include "tests/model/support.hpp"

namespace lk::model::test {
namespace protection_test {

constexpr double kPeriod = 125e-6;
using Settings = std::array<Protection, kErrorKinds>;

/// Returns values of a normal drive, with one quantity set to `value`.
Watched watched(Error error, double value) {
  Watched w{.v_bus = 24.0, .temp_motor = 30.0, .temp_driver = 30.0, .i_peak = 1.0, .omega = 50.0};
  switch (error) {
    case Error::kUnderVoltage:
    case Error::kOverVoltage:
      w.v_bus = value;
      break;
    case Error::kDriverTemperature:
      w.temp_driver = value;
      break;
    case Error::kMotorTemperature:
      w.temp_motor = value;
      break;
    case Error::kOverCurrent:
    case Error::kShort:
      w.i_peak = value;
      break;
    case Error::kStall:
    case Error::kLostInput:
      break;
  }
  return w;
}

struct Case {
  Error error;
  double threshold, inside, beyond, recovered;
};

class Thresholds : public testing::TestWithParam<Case> {};

TEST_P(Thresholds, TripAfterTheDelayAndClearBelowTheHysteresis) {
  const Case c = GetParam();
  constexpr double kDelay = 0.010;
  const Settings settings = protecting(c.error, {true, c.threshold, 1.0, kDelay}).protections;
  ProtectionState s;
  settings_changed(settings, s);
  for (int n = 0; n < 1000; ++n) {
    EXPECT_FALSE(watch(settings, watched(c.error, c.inside), kPeriod, s));
  }
  EXPECT_EQ(s.latched, 0);

  // Shorter than the delay: no trip, and the delay restarts.
  for (int n = 0; n < 70; ++n) {
    EXPECT_FALSE(watch(settings, watched(c.error, c.beyond), kPeriod, s));
  }
  watch(settings, watched(c.error, c.inside), kPeriod, s);
  int periods = 0;
  while (!watch(settings, watched(c.error, c.beyond), kPeriod, s) && periods < 1000) {
    ++periods;
  }
  EXPECT_NEAR((periods + 1) * kPeriod, kDelay, 1.01 * kPeriod);
  EXPECT_EQ(s.latched, bit(c.error));

  // Beyond the threshold or within the hysteresis the cause is not over; the error stays latched
  // afterwards.
  for (const double value : {c.beyond, c.inside}) {
    watch(settings, watched(c.error, value), kPeriod, s);
    clear_errors(settings, s);
    EXPECT_EQ(s.latched, bit(c.error));
  }
  for (int n = 0; n < 10; ++n) {
    watch(settings, watched(c.error, c.recovered), kPeriod, s);
  }
  EXPECT_EQ(s.latched, bit(c.error));
  clear_errors(settings, s);
  EXPECT_EQ(s.latched, 0);
}

// `inside` is within the hysteresis of 1 around the threshold.
INSTANTIATE_TEST_SUITE_P(Protection, Thresholds,
                         testing::Values(Case{Error::kUnderVoltage, 7.0, 7.5, 6.5, 8.5},
                                         Case{Error::kOverVoltage, 30.0, 29.5, 30.5, 28.5},
                                         Case{Error::kDriverTemperature, 100.0, 99.5, 100.5, 98.0},
                                         Case{Error::kMotorTemperature, 100.0, 99.5, 100.5, 98.0},
                                         Case{Error::kOverCurrent, 20.0, 19.5, 20.5, 18.0},
                                         Case{Error::kShort, 30.0, 29.5, 30.5, 28.0}));

TEST(Protection, DisabledNeverTrips) {
  Settings settings{};
  for (Protection& p : settings) {
    p = {false, 0.0, 0.0, 0.0};
  }
  ProtectionState s;
  settings_changed(settings, s);
  for (int n = 0; n < 100; ++n) {
    EXPECT_FALSE(watch(
        settings, {.v_bus = 1e3, .temp_motor = 1e3, .temp_driver = 1e3, .i_peak = 1e3}, 1.0, s));
  }
  EXPECT_EQ(s.latched, 0);
}

TEST(Protection, StallIsStandingStillAgainstTheCurrentLimit) {
  DriveParams d = ideal_drive();
  ControlSettings settings = protecting(Error::kStall, {true, 0.5, 0.0, 0.0});
  settings.i_q_max = 4.0;
  // A turning shaft is not stalled, at any current.
  d.mechanics.B = 4.0 * k_t(d.motor) / 60.0;
  DriveBank turning = one_drive(d, settings);
  turning.command(0, Speed{200.0});
  turning.advance(ticks_in(d, 1.5));
  EXPECT_EQ(turning.telemetry(0).errors, 0);
  // A locked shaft stalls after the threshold of half a second.
  d.mechanics.J = 1e3;
  DriveBank locked = one_drive(d, settings);
  locked.command(0, Speed{200.0});
  locked.advance(ticks_in(d, 0.49));
  EXPECT_EQ(locked.telemetry(0).errors, 0);
  locked.advance(ticks_in(d, 0.05));
  EXPECT_EQ(locked.telemetry(0).errors, bit(Error::kStall));
  // A shaft at rest under a small torque is not stalled.
  DriveBank resting = one_drive(d, settings);
  resting.command(0, Torque{2.0});
  resting.advance(ticks_in(d, 1.5));
  EXPECT_EQ(resting.telemetry(0).errors, 0);
  // A shaft with a current limit near zero is not stalled, at any sensor noise.
  settings.i_q_max = 1e-6;
  d.current_sensor.noise = 0.05;
  DriveBank powerless = one_drive(d, settings);
  powerless.command(0, Speed{200.0});
  powerless.advance(ticks_in(d, 1.5));
  EXPECT_EQ(powerless.telemetry(0).errors, 0);
}

TEST(Protection, LostInputCountsFromTheLastFrame) {
  DriveParams d = ideal_drive();
  DriveBank bank = one_drive(d, protecting(Error::kLostInput, {true, 0.1, 0.0, 0.0}));
  bank.command(0, Torque{0.5});
  for (int n = 0; n < 10; ++n) {  // fed every 60 ms
    bank.feed_input(0);
    bank.advance(ticks_in(d, 0.06));
    ASSERT_EQ(bank.telemetry(0).errors, 0) << n;
  }
  bank.feed_input(0);
  bank.advance(ticks_in(d, 0.099));
  EXPECT_EQ(bank.telemetry(0).errors, 0);
  bank.advance(ticks_in(d, 0.002));
  EXPECT_EQ(bank.telemetry(0).errors, bit(Error::kLostInput));
  EXPECT_FALSE(bank.telemetry(0).bridge_on);
}

TEST(Protection, TrippedDriveOpensItsBridgeAndStaysOff) {
  DriveParams d = ideal_drive();
  d.mechanics.J = 1e3;
  DriveBank bank = one_drive(d, protecting(Error::kOverCurrent, {true, 5.0, 1.0, 0.0}));
  bank.command(0, Torque{4.0});
  bank.advance(ticks_in(d, 0.1));
  EXPECT_EQ(bank.telemetry(0).errors, 0);
  bank.command(0, Torque{8.0});
  bank.advance(ticks_in(d, 0.1));
  EXPECT_EQ(bank.telemetry(0).errors, bit(Error::kOverCurrent));
  EXPECT_FALSE(bank.telemetry(0).bridge_on);
  EXPECT_EQ(bank.truth(0).i_q, 0.0);
  bank.clear_errors(0);
  bank.advance(ticks_in(d, 0.01));
  EXPECT_EQ(bank.telemetry(0).errors, 0);
  EXPECT_FALSE(bank.telemetry(0).bridge_on);  // until the next setpoint
  bank.command(0, Torque{2.0});
  bank.advance(ticks_in(d, 0.05));
  EXPECT_TRUE(bank.telemetry(0).bridge_on);
  EXPECT_NEAR(bank.truth(0).i_q, 2.0, 0.05);
}

}  // namespace protection_test
}  // namespace lk::model::test
