// The energy balance holds: supplied = lost + delivered + stored (docs/internals/model.md §8).
#include "tests/model/profiles.hpp"

namespace lk::model::test {
namespace energy_test {

/// Two seconds with all kinds of motion: accelerate, reverse, positions, torque, coasting.
void mixed_two_seconds(DriveBank& bank, const std::vector<NamedDrive>& drives) {
  const auto all = [&](auto setpoint_of) {
    for (std::size_t n = 0; n < drives.size(); ++n) {
      bank.command(n, setpoint_of(drives[n].init));
    }
  };
  const auto free_speed = [](const DriveInit& d) {
    return d.params.supply.v_source / std::sqrt(3.0) /
           (d.params.motor.pole_pairs * d.params.motor.psi_f);
  };
  const auto advance = [&](double seconds) {
    bank.advance(ticks_in(drives.front().init.params, seconds));
  };
  all([&](const DriveInit& d) { return Speed{0.6 * free_speed(d)}; });
  advance(0.4);
  all([&](const DriveInit& d) { return Speed{-0.5 * free_speed(d)}; });
  advance(0.3);
  all([](const DriveInit&) { return Position{5.0}; });
  advance(0.4);
  all([](const DriveInit& d) {
    return Torque{-0.1 * d.params.supply.v_source / d.params.motor.R_s};
  });
  advance(0.15);
  all([](const DriveInit& d) {
    return Torque{0.1 * d.params.supply.v_source / d.params.motor.R_s};
  });
  advance(0.15);
  all([](const DriveInit&) { return Off{}; });
  advance(0.2);
  all([&](const DriveInit& d) { return Position{-20.0, 0.3 * free_speed(d)}; });
  advance(0.4);
}

void expect_closed(const std::vector<NamedDrive>& drives) {
  DriveBank bank = bank_of(drives);
  std::vector<EnergyLedger> start;
  for (std::size_t n = 0; n < drives.size(); ++n) start.push_back(bank.energy(n));
  mixed_two_seconds(bank, drives);
  for (std::size_t n = 0; n < drives.size(); ++n) {
    const EnergyLedger e = bank.energy(n);
    const double supplied = e.supply - start[n].supply;
    EXPECT_GT(supplied, 0.05) << drives[n].name;  // otherwise the bound below would mean little
    EXPECT_GT(e.friction, 0.0) << drives[n].name;
    EXPECT_GT(e.copper, 0.0) << drives[n].name;
    // Requirement: 0.1 % of the supplied energy.
    EXPECT_LT(std::abs(residual(e, start[n])), 1e-3 * supplied) << drives[n].name;
  }
}

template <class Change>
void expect_closed_for_all(Change change) {
  for (std::vector<NamedDrive>& group : profiles_by_rate()) {
    for (NamedDrive& drive : group) {
      change(drive.init.params);
    }
    expect_closed(group);
  }
}

TEST(EnergyLedger, ClosesForEveryProfile) {
  expect_closed_for_all([](DriveParams&) {});
}

TEST(EnergyLedger, ClosesWithSalientPoles) {
  expect_closed_for_all([](DriveParams& d) { d.motor.L_q = 2.0 * d.motor.L_d; });
}

TEST(EnergyLedger, ClosesWithALoad) {
  expect_closed_for_all([](DriveParams& d) {
    const double gear = d.mechanics.gear_ratio;
    const double torque = 0.05 * k_t(d.motor) * d.supply.v_source / d.motor.R_s * gear;
    d.load.J = 2.0 * d.mechanics.J * gear * gear;
    d.load.tau = 0.3 * torque;
    d.load.tau_gravity = torque;
  });
}

TEST(EnergyLedger, ClosesWhenTheSourceTakesNothingBack) {
  expect_closed_for_all([](DriveParams& d) { d.supply.i_regen_max = 0.0; });
}

TEST(EnergyLedger, ClosesWithASpringAndPlayInTheGear) {
  expect_closed_for_all([](DriveParams& d) {
    const double gear2 = d.mechanics.gear_ratio * d.mechanics.gear_ratio;
    d.mechanics.J_out = 0.2 * d.mechanics.J * gear2;
    // 60 Hz between the shafts, well damped.
    d.mechanics.gear_stiffness_out = d.mechanics.J_out * 377.0 * 377.0;
    d.mechanics.gear_damping_out = 0.2 * d.mechanics.J_out * 377.0;
    d.mechanics.backlash_out = 1e-3;
  });
}

}  // namespace energy_test
}  // namespace lk::model::test
