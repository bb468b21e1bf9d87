// Under any faults, alone or together, and any setpoint, the state stays finite and bounded. A
// healed drive works again (docs/internals/model.md §14).
#include "tests/model/mixed_run.hpp"
#include "tests/model/support.hpp"
#include "tests/support/sweep.hpp"

namespace lk::model::test {
namespace fault_survival_test {

const int kRounds = lk::test::all_values() ? 600 : 60;

/// Random numbers: xorshift64, because the bits of library distributions differ.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : word_(noise_seed(seed)) {}
  std::uint64_t upto(std::uint64_t n) {
    word_ ^= word_ << 13U;
    word_ ^= word_ >> 7U;
    word_ ^= word_ << 17U;
    return (word_ >> 20U) % n;
  }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(upto(1U << 20U)) / (1U << 20U);
  }
  /// True one time in four.
  bool seldom() { return upto(4) == 0; }

 private:
  std::uint64_t word_;
};

Faults thrown(Dice& dice) {
  Faults f;
  const auto stuck = [&dice](double low, double high) -> std::optional<double> {
    return dice.seldom() ? std::optional(dice.between(low, high)) : std::nullopt;
  };
  f.encoder = dice.seldom() ? static_cast<EncoderFault>(dice.upto(4)) : EncoderFault::kNone;
  f.encoder_offset = dice.seldom() ? dice.between(-10.0, 10.0) : 0.0;
  f.encoder_noise = dice.seldom() ? dice.between(0.0, 1.0) : 0.0;
  f.encoder_latency = dice.seldom() ? dice.between(0.0, 0.01) : 0.0;
  for (Faults::Current* channel : {&f.current_a, &f.current_b}) {
    channel->offset = dice.seldom() ? dice.between(-40.0, 40.0) : 0.0;
    channel->gain = dice.seldom() ? dice.between(-2.0, 5.0) : 1.0;
    channel->stuck = stuck(-40.0, 40.0);
  }
  f.current_noise = dice.seldom() ? dice.between(0.0, 10.0) : 0.0;
  f.v_bus_stuck = stuck(0.0, 100.0);
  f.v_bus_offset = dice.seldom() ? dice.between(-50.0, 50.0) : 0.0;
  f.temp_motor_stuck = stuck(-40.0, 200.0);
  f.temp_driver_offset = dice.seldom() ? dice.between(-100.0, 100.0) : 0.0;
  f.bridge_dead = dice.seldom();
  for (LegFault& leg : f.legs) {
    leg = dice.seldom() ? static_cast<LegFault>(dice.upto(6)) : LegFault::kNone;
  }
  f.jam = dice.seldom() ? dice.between(0.0, 1.2) : 0.0;
  f.friction = dice.seldom() ? dice.between(0.0, 20.0) : 1.0;
  f.inertia = dice.seldom() ? dice.between(0.2, 20.0) : 1.0;
  f.backlash = dice.seldom() ? dice.between(0.0, 20.0) : 1.0;
  f.load_torque = dice.seldom() ? dice.between(-1.0, 1.0) : 0.0;
  f.coupling_broken = dice.seldom();
  f.theta_min = dice.seldom() ? dice.between(-5.0, 0.0) : -kNoStop;
  f.theta_max = dice.seldom() ? dice.between(0.1, 5.0) : kNoStop;
  f.v_source_max = dice.seldom() ? dice.between(0.0, 30.0) : 1e9;
  f.supply_cut = dice.seldom();
  f.no_regeneration = dice.seldom();
  f.commutation_offset = dice.seldom() ? dice.between(-4.0, 4.0) : 0.0;
  f.brake_delay = dice.seldom() ? dice.between(0.0, 0.2) : 0.0;
  f.clock_ratio = dice.seldom() ? dice.between(0.5, 2.0) : 1.0;
  return f;
}

/// Drives rigid and springy, with and without current loop.
std::vector<DriveInit> assorted() {
  std::vector<DriveInit> inits(4);
  for (DriveInit& init : inits) {
    init.params.mechanics.tau_coulomb = 0.004;
    init.params.mechanics.tau_static = 0.005;
    init.params.mechanics.B = 1e-5;
    init.params.supply.i_logic = 0.05;
    // A rectifier's link needs a protection that opens the bridge, as on a real test bench.
    init.settings.protections[static_cast<std::size_t>(Error::kOverVoltage)] = {true, 36.0, 1.0,
                                                                                0.0};
    init.settings.omega_max = 100.0;
  }
  inits[1].params.control.has_current_loop = false;
  for (const std::size_t n : {2U, 3U}) {
    MechanicsParams& m = inits[n].params.mechanics;
    m.gear_ratio = 6.0;
    m.gear_efficiency = 0.9;
    m.tau_coulomb_out = 0.02;
    m.J_out = 5e-4;
  }
  inits[3].params.mechanics.backlash_out = 0.002;
  inits[3].params.mechanics.gear_stiffness_out = 400.0;
  inits[3].params.mechanics.gear_damping_out = 0.3;
  inits[3].params.load.J = 1e-4;
  return inits;
}

Setpoint told(Dice& dice) {
  switch (dice.upto(6)) {
    case 0:
      return Off{};
    case 1:
      return Idle{};
    case 2:
      return Torque{dice.between(-20.0, 20.0)};
    case 3:
      return Speed{dice.between(-90.0, 90.0)};
    case 4:
      return OpenLoop{dice.between(-1.0, 1.0)};
    default:
      return Position{dice.between(-20.0, 20.0)};
  }
}

TEST(FaultSurvival, StateStaysFiniteUnderAnyFaults) {
  const std::vector<DriveInit> inits = assorted();
  DriveBank bank(inits);
  Dice dice(4711);
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t n = 0; n < bank.size(); ++n) {
      bank.command(n, told(dice));
      bank.set_faults(n, dice.seldom() ? Faults{} : thrown(dice));
      bank.kick(n, dice.seldom() ? dice.between(-1e-3, 1e-3) : 0.0);
      bank.clear_errors(n);
    }
    bank.advance(640);
    for (std::size_t n = 0; n < bank.size(); ++n) {
      const Truth t = bank.truth(n);
      SCOPED_TRACE("round " + std::to_string(round) + " drive " + std::to_string(n));
      ASSERT_TRUE(all_finite(bank, n));
      ASSERT_GT(t.v_bus, -2.0);
      ASSERT_LT(t.v_bus, 200.0);
      ASSERT_LT(std::hypot(t.i_d, t.i_q), 1500.0);
      ASSERT_LT(std::abs(t.omega_m), 5e3);
      ASSERT_FALSE(bank.takes_effect(n, {}));
    }
  }
}

TEST(FaultSurvival, HealedDriveWorksAsBefore) {
  const std::vector<DriveInit> inits = assorted();
  DriveBank bank(inits);
  Dice dice(815);
  for (int round = 0; round < kRounds / 20; ++round) {
    for (std::size_t n = 0; n < bank.size(); ++n) {
      bank.set_faults(n, thrown(dice));
      bank.command(n, told(dice));
    }
    bank.advance(1600);
    for (std::size_t n = 0; n < bank.size(); ++n) {
      bank.set_faults(n, {});
      bank.command(n, Off{});
    }
    bank.advance(16000);  // the link recovers, the controller boots, shafts come to rest
    for (std::size_t n = 0; n < bank.size(); ++n) {
      ASSERT_TRUE(bank.alive(n)) << "round " << round << " drive " << n;
      bank.clear_errors(n);
      ASSERT_EQ(bank.telemetry(n).errors, 0) << "round " << round << " drive " << n;
      bank.command(n, Speed{30.0});
    }
    bank.advance(32000);
    for (std::size_t n = 0; n < bank.size(); ++n) {
      SCOPED_TRACE("round " + std::to_string(round) + " drive " + std::to_string(n));
      const Truth t = bank.truth(n);
      EXPECT_NEAR(t.omega_m, 30.0, 1.5);
      EXPECT_NEAR(bank.telemetry(n).omega, 30.0, 1.5);
      EXPECT_NEAR(t.theta_out, t.theta_m / inits[n].params.mechanics.gear_ratio, 0.01);
      // The encoder counts as if there had been no fault: 30 rad/s are 2.4 counts a period.
      EXPECT_NEAR(static_cast<double>(bank.telemetry(n).encoder_position),
                  t.theta_m * 16384.0 / (2.0 * kPiT), 8.0);
    }
  }
}

}  // namespace fault_survival_test
}  // namespace lk::model::test
