// Under any commands the state stays finite and within the physical limits.
#include <functional>

#include "tests/model/mixed_run.hpp"
#include "tests/model/profiles.hpp"
#include "tests/support/sweep.hpp"

namespace lk::model::test {
namespace survival_test {

using lk::test::all_values;

/// Simulated seconds, and the length of a stretch relative to a full run.
double run_s() { return all_values() ? 60.0 : 7.0; }
double stretch_share() { return all_values() ? 1.0 : 0.5; }
double standstill_s() { return all_values() ? 600.0 : 3.0; }

void expect_sane(const DriveBank& bank, const std::vector<NamedDrive>& drives,
                 const std::string& what) {
  for (std::size_t n = 0; n < drives.size(); ++n) {
    const DriveParams& d = drives[n].init.params;
    const Truth t = bank.truth(n);
    SCOPED_TRACE(drives[n].name + ' ' + what);
    ASSERT_TRUE(all_finite(bank, n));
    for (const double duty : t.duty_abc) {
      ASSERT_GE(duty, 0.0);
      ASSERT_LE(duty, 1.0);
    }
    // Limits of a bridge: twice the link against R (back-EMF in phase with it), at twice the speed
    // at which the back-EMF equals the link.
    ASSERT_LT(std::hypot(t.i_d, t.i_q), 2.0 * d.supply.v_source / d.motor.R_s);
    ASSERT_LT(std::abs(t.omega_m), 2.0 * d.supply.v_source / (d.motor.pole_pairs * d.motor.psi_f));
    ASSERT_GT(t.v_bus, 0.0);
    ASSERT_LT(t.v_bus, 5.0 * d.supply.v_source);
  }
}

/// Commands `setpoint_of(drive, n)`, a new one every `stretch` seconds of a full run.
template <class SetpointOf>
void survive(
    const std::string& what, double stretch, SetpointOf setpoint_of,
    const std::function<void(DriveInit&)>& change = [](DriveInit&) {}) {
  stretch *= stretch_share();
  for (std::vector<NamedDrive>& group : profiles_by_rate()) {
    for (NamedDrive& drive : group) {
      change(drive.init);
    }
    DriveBank bank = bank_of(group);
    for (int n = 0; n * stretch < run_s(); ++n) {
      for (std::size_t drive = 0; drive < group.size(); ++drive) {
        bank.command(drive, setpoint_of(group[drive].init, n));
      }
      bank.advance(ticks_in(group.front().init.params, stretch));
      expect_sane(bank, group, what + ", stretch " + std::to_string(n));
      if (testing::Test::HasFatalFailure()) {
        return;
      }
    }
  }
}

double sign(int n) { return n % 2 == 0 ? 1.0 : -1.0; }
constexpr double kWireSpeed = 3.75e5;     // rad/s: int32 of 0.01 °/s
constexpr double kWirePosition = 3.75e5;  // rad: int32 of 0.01 °

Setpoint at_the_limits(const DriveInit& d, int n) {
  const std::array<Setpoint, 9> kinds{Torque{33.0 * sign(n / 9)},
                                      Speed{kWireSpeed * sign(n / 9)},
                                      Position{kWirePosition * sign(n / 9)},
                                      OpenLoop{sign(n / 9)},
                                      Off{},
                                      Speed{1e-3, 0.01},
                                      Position{0.0, 1e-3},
                                      Idle{},
                                      Position{10.0 * sign(n), d.settings.omega_max}};
  return kinds[static_cast<std::size_t>(n) % kinds.size()];
}

TEST(Survival, TargetsBeyondReach) {
  survive("rails", 1.5, [](const DriveInit&, int n) -> Setpoint {
    switch (n / 3 % 3) {
      case 0:
        return Torque{sign(n) * 33.0};
      case 1:
        return Speed{sign(n) * kWireSpeed};
      default:
        return Position{sign(n) * kWirePosition};
    }
  });
}
TEST(Survival, FullVoltageAndBridgeOff) {
  survive("voltage", 0.7, [](const DriveInit&, int n) -> Setpoint {
    return n % 3 == 2 ? Setpoint{Off{}} : Setpoint{OpenLoop{sign(n)}};
  });
}
TEST(Survival, EverySetpointAtItsLimits) { survive("limits", 0.35, at_the_limits); }

TEST(Survival, EverySetpointWithTheLargestGains) {
  survive("bytes 255", 0.7, at_the_limits,
          [](DriveInit& d) { d.settings.gains = {255, 255, 255, 255, 255, 255}; });
}
TEST(Survival, EverySetpointWithoutGains) {
  survive("bytes 0", 0.7, at_the_limits,
          [](DriveInit& d) { d.settings.gains = {0, 0, 0, 0, 0, 0}; });
}
TEST(Survival, EverySetpointWithExtremeRampsAndABlockedSource) {
  survive("ramps", 0.7, at_the_limits, [](DriveInit& d) {
    d.settings.accel_max = 1e-3;
    d.settings.current_ramp = 1e-3;
    d.settings.gains = {255, 0, 0, 255, 1, 255};
  });
  survive("rectifier", 0.7, at_the_limits, [](DriveInit& d) {
    d.settings.accel_max = 1e6;
    // The protection replaces a braking chopper, as on a real test bench.
    d.params.supply.i_regen_max = 0.0;
    d.settings.protections[static_cast<std::size_t>(Error::kOverVoltage)] = {
        true, 1.5 * d.params.supply.v_source, 1.0, 0.0};
  });
}

/// More than any rotor withstands: a thousand times the torque that tears it off its bench, and
/// impacts.
TEST(Survival, ExtremeLoadsAndImpacts) {
  for (std::vector<NamedDrive>& group : profiles_by_rate()) {
    DriveBank bank = bank_of(group);
    for (int n = 0; n < 40; ++n) {
      for (std::size_t drive = 0; drive < group.size(); ++drive) {
        LoadParams load;
        load.tau = 1000.0 * sign(n / 4);
        bank.set_load(drive, load);
        if (n % 3 == 0) bank.kick(drive, 100.0 * sign(n / 6));
        bank.command(drive, at_the_limits(group[drive].init, n));
      }
      bank.advance(ticks_in(group.front().init.params, 0.05));
      for (std::size_t drive = 0; drive < group.size(); ++drive) {
        const DriveParams& d = group[drive].init.params;
        const Truth t = bank.truth(drive);
        ASSERT_TRUE(all_finite(bank, drive)) << group[drive].name << ", step " << n;
        // Two radians of the field in a PWM period (docs/internals/model.md §4); a whole turn is 2
        // pi.
        const double most = 2.0 * d.inverter.f_pwm / d.motor.pole_pairs;
        ASSERT_LE(std::abs(t.omega_m), most * (1 + 1e-12)) << group[drive].name;
      }
    }
  }
}

/// Loads the drives with a third of their break-away torque, bridges off; they must not move once
/// settled.
void expect_standstill(std::vector<NamedDrive> drives, double seconds) {
  for (NamedDrive& drive : drives) {
    DriveParams& d = drive.init.params;
    d.load.tau =
        0.3 * std::max(d.mechanics.tau_static, d.mechanics.tau_coulomb) * d.mechanics.gear_ratio;
    ASSERT_GT(d.load.tau, 0.0) << drive.name;
    drive.init.theta_m = 0.25;
  }
  DriveBank bank = bank_of(drives);
  for (std::size_t n = 0; n < drives.size(); ++n) {
    bank.command(n, Off{});
  }
  bank.advance(ticks_in(drives.front().init.params, 2.0));  // the load takes up the gear's play
  const DriveBank settled = bank;
  bank.advance(ticks_in(drives.front().init.params, seconds));
  for (std::size_t n = 0; n < drives.size(); ++n) {
    EXPECT_EQ(bank.truth(n).theta_m, settled.truth(n).theta_m) << drives[n].name;
    EXPECT_EQ(bank.truth(n).omega_m, 0.0) << drives[n].name;
    EXPECT_NEAR(bank.truth(n).theta_m, 0.25, 0.1) << drives[n].name;
  }
}

TEST(Standstill, FrictionHoldsEveryProfile) {
  for (const std::vector<NamedDrive>& group : profiles_by_rate()) {
    expect_standstill(group, standstill_s());
  }
}

}  // namespace survival_test
}  // namespace lk::model::test
