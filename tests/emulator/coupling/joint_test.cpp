// What goes through a joint between a drive and a body: torque, energy, friction, faults.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>

#include "emulator/core/coupling/coupling.hpp"
#include "tests/emulator/coupling/coupling_support.hpp"
#include "tests/support/bus_config.hpp"
#include "tests/support/faults.hpp"

namespace lk::test {
namespace joint_test {

using emulator::Bus;
using emulator::BusConfig;
using emulator::Coupling;
using emulator::ServoConfig;

/// A bus of one frictionless drive on a body, step by step.
class OnBody {
 public:
  OnBody(std::shared_ptr<const emulator::Mechanism> body, ServoConfig servo)
      : config_(make(std::move(body), std::move(servo))),
        bus_(config_),
        buses_{&bus_},
        coupling_(std::span(&config_, 1), buses_) {}

  void advance(double seconds) {
    const auto until =
        bus_.time() + std::chrono::round<emulator::SimTime>(std::chrono::duration<double>(seconds));
    while (coupling_.next_due() <= until) {
      bus_.reach(coupling_.next_due());
      coupling_.exchange(buses_);
    }
    bus_.advance_to(until);
  }
  void torque_current(double iq_A) {
    const auto& servo = config_.servos.front();
    bus_.receive(
        {bus_.time(), protocol::encode_query(
                          1, protocol::Torque{iq_A},
                          protocol::wire_format(servo.quirks.dialect, servo.profile.series))});
  }
  void fault(std::string_view word, std::initializer_list<emulator::FaultValue> values = {}) {
    ASSERT_TRUE(bus_.apply({emulator::kWholeBus, emulator::SetFault{fault_of(word, values, {1})}}));
  }
  void heal() { bus_.apply({emulator::kWholeBus, emulator::ClearFault{"all"}}); }
  model::Truth truth() const { return bus_.truth(1); }
  const HandBody& body() const { return dynamic_cast<const HandBody&>(coupling_.mechanism()); }
  model::EnergyLedger energy() {
    const auto place = bus_.motors().place_of(config_.servos.front(), config_);
    return bus_.motors().bank(place).energy(bus_.motors().index(place));
  }

 private:
  static BusConfig make(std::shared_ptr<const emulator::Mechanism> body, ServoConfig servo) {
    BusConfig config = bus_config({});
    servo.joint = emulator::JointLink{.start_rad = body->joint(0).angle_rad};
    config.servos = {std::move(servo)};
    config.body = std::move(body);
    return config;
  }
  BusConfig config_;
  Bus bus_;
  std::array<Bus*, 1> buses_;
  Coupling coupling_;
};

ServoConfig geared_drive(double ratio) {
  ServoConfig servo = servo_config(1);
  servo.profile.drive.mechanics.gear_ratio = ratio;
  servo.profile.drive.mechanics.J_out = 1e-4;
  return servo;
}

TEST(Joint, HasTheRotorsInertiaOnceAndOnlyOnce) {
  const double J_body = 0.02;
  OnBody run(std::make_shared<HandBody>(1, linear_inertia(J_body), kMs), geared_drive(10));
  run.torque_current(1.0);
  run.advance(0.05);
  const double omega = run.truth().omega_out;
  double tau_e = 0;  // mean
  for (int n = 0; n < 1000; ++n) {
    run.advance(0.0001);
    tau_e += run.truth().tau_e / 1000;
  }
  const model::MechanicsParams m = geared_drive(10).profile.drive.mechanics;
  const double J = 100 * m.J + m.J_out + J_body;
  EXPECT_GT(tau_e, 0.05);
  EXPECT_NEAR((run.truth().omega_out - omega) / 0.1, 10 * tau_e / J, 1e-3 * 10 * tau_e / J);
}

/// What a drive gives is what the body takes: 0.1 % of all that went through.
TEST(Joint, LosesNoEnergy) {
  const double mgl = 0.6;
  OnBody run(std::make_shared<HandBody>(1, pendulum(0.02, mgl), kMs, Two{0.5, 0}),
             geared_drive(10));
  const double before = run.body().energy_J();
  const double stored_before = run.energy().stored;
  double through = 0;
  double last = before;
  for (int n = 0; n < 500; ++n) {
    if (n % 50 == 0) run.torque_current(n % 100 == 0 ? 0.8 : -0.8);
    run.advance(0.001);
    through += std::abs(run.body().energy_J() - last);
    last = run.body().energy_J();
  }
  const model::EnergyLedger e = run.energy();
  EXPECT_NEAR(e.supply,
              e.copper + e.inverter + e.friction + e.gear + e.load + e.stored - stored_before,
              1e-6 * e.supply);
  // The drive keeps the books of the inertia that it sees, the body those of the armature.
  const model::MechanicsParams m = geared_drive(10).profile.drive.mechanics;
  const double omega = run.body().speeds()[0];
  const double armature = 0.5 * (100 * m.J + m.J_out) * omega * omega;
  const double seen = 0.5 * 0.02 * omega * omega;
  EXPECT_GT(through, 0.3);
  EXPECT_NEAR(e.load + seen, run.body().energy_J() - armature - before, 1e-3 * through);
}

TEST(Joint, IsHeldByFrictionAsLongAsThatIsEnough) {
  ServoConfig servo = servo_config(1);
  servo.profile.drive.mechanics.tau_coulomb = 0.05;
  servo.profile.drive.mechanics.tau_static = 0.06;
  const auto body = [](double angle) {
    return std::make_shared<HandBody>(1, pendulum(0.01, 0.1), kMs, Two{angle, 0});
  };
  OnBody held(body(0.5), servo);  // 0.048 Nm
  held.advance(2);
  EXPECT_NEAR(held.body().angles()[0], 0.5, 1e-12);
  OnBody slips(body(0.7), servo);  // 0.064 Nm
  slips.advance(2);
  EXPECT_LT(slips.body().angles()[0], 0.6);
}

/// The rotor turns on alone, the arm falls as one without a drive.
TEST(Joint, FallsWhenItsCouplingBreaks) {
  for (const double stiffness : {0.0, 4500.0}) {
    ServoConfig servo = geared_drive(10);
    servo.profile.drive.mechanics.gear_stiffness_out = stiffness;
    servo.profile.drive.mechanics.tau_coulomb = 0.5;  // holds the arm
    const double mgl = 0.6;
    const double J = 0.02;
    OnBody run(std::make_shared<HandBody>(1, pendulum(J, mgl), kMs, Two{0.1, 0}), servo);
    run.advance(0.1);
    EXPECT_NEAR(run.body().angles()[0], 0.1, 2e-3);
    const double rotor = run.truth().theta_m;
    run.fault("coupling_broken");
    // Half a period of a small swing, from one side to the other; its flange goes along.
    const double omega = std::sqrt(mgl / (J + 1e-4));
    run.advance(3.14159265 / omega);
    EXPECT_NEAR(run.body().angles()[0], -0.1, 2e-3) << stiffness;
    EXPECT_NEAR(run.truth().theta_m, rotor, 0.05) << stiffness;
    run.heal();  // where it stands, both grip
    run.advance(0.2);
    EXPECT_NEAR(run.body().angles()[0], -0.1, 5e-3) << stiffness;
    EXPECT_NEAR(run.truth().theta_m, rotor, 0.1) << stiffness;
  }
}

TEST(Joint, StopsAtAnEndStopOfTheDrive) {
  OnBody run(std::make_shared<HandBody>(1, pendulum(0.02, 0.6), kMs, Two{1.0, 0}), servo_config(1));
  run.fault("end_stop", {-30.0, 1e6});  // degrees from where it stands
  double least = 1;
  for (int n = 0; n < 1000; ++n) {
    run.advance(0.001);
    least = std::min(least, run.body().angles()[0]);
  }
  EXPECT_NEAR(least, 1.0 - 3.14159265 / 6, 1e-4);
}

}  // namespace joint_test
}  // namespace lk::test
