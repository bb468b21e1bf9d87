// The limits in docs/guides/your-simulator.md, each from both sides, with a linear drive and
// simulator, so that growth and decay can be computed by hand.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "emulator/core/coupling/coupling.hpp"
#include "emulator/io/shafts/shaft_body.hpp"
#include "tests/support/bus_config.hpp"
#include "tests/support/frames.hpp"
#include "tests/support/profile.hpp"

namespace lk::emulator {
namespace stability_test {

constexpr SimTime kStep = std::chrono::milliseconds(1);
constexpr double kStep_s = 1e-3;

/// A drive that is on but not driven; only `B`, Nm·s/rad, acts on its shaft.
BusConfig one_drive(double B) {
  BusConfig config = test::bus_config({1});
  model::DriveParams& drive = config.servos[0].profile.drive;
  drive.mechanics.B = B;
  drive.mechanics.tau_coulomb = 0;
  drive.mechanics.tau_static = 0;
  drive.mechanics.tau_cogging = 0;
  config.servos[0].boot_angle_deg = 0;
  return config;
}

using Simulator = std::function<lk_shafts_state(const lk_shafts_torque&)>;

/// A drive whose shaft a simulator has, and when it sends what.
struct Setting {
  BusConfig config;
  lk_shafts_accept terms;
  lk_shafts_state first;
  double armature = Bus(config).state().mounted_shaft(1).armature;
  bool one_shaft = false;
  SimTime step = kStep;
  std::optional<protocol::Frame> query = {};  // to the drive, at the start
};

/// Returns the joint's speed after each step; empty if it diverged.
std::vector<double> run(const Setting& setting, const Simulator& simulator, std::int64_t steps) {
  Bus bus(setting.config);
  Bus* const buses[] = {&bus};
  auto made = std::make_unique<ShaftBody>(
      std::vector<ShaftJoint>{
          {"test:1", setting.terms, 0, setting.first.speed_rad_s, setting.armature}},
      setting.step);
  ShaftBody& body = *made;
  body.take({&setting.first, 1});
  const CoupledDrive drive{0, 1, {}, setting.one_shaft};
  Coupling coupling(std::move(made), {&drive, 1}, SimTime{0});
  coupling.begin(buses);
  if (setting.query) bus.receive({bus.time(), *setting.query});
  std::vector<double> speeds;
  for (std::int64_t n = 0; n < steps; ++n) {
    bus.reach(coupling.next_due());
    coupling.finish(buses);
    const lk_shafts_state now = simulator(body.torques()[0]);
    if (body.problem_of({&now, 1})) return {};
    body.take({&now, 1});
    speeds.push_back(body.joint(0).speed_rad_s);
    coupling.begin(buses);
  }
  return speeds;
}

double armature() { return Bus(one_drive(0)).state().mounted_shaft(1).armature; }

/// Returns the largest of the last ten speeds relative to the largest of the first ten.
double growth(const std::vector<double>& speeds) {
  if (speeds.empty()) return std::numeric_limits<double>::infinity();
  const auto most = [](auto from, auto to) {
    double found = 0;
    for (; from != to; ++from) found = std::max(found, std::abs(*from));
    return found;
  };
  return most(speeds.end() - 10, speeds.end()) / most(speeds.begin(), speeds.begin() + 10);
}

/// A free joint of inertia `I` in the simulator. Its drive brakes it to a stop within one step.
/// `told`: the inertia that the simulator sends.
double growth_of_braked(double I, double told, std::uint32_t flags) {
  const double B = 20 * std::max(I, told) / kStep_s;
  double angle = 0;
  double speed = 0.1;
  const auto simulator = [&](const lk_shafts_torque& drive) {
    angle += kStep_s * speed;
    speed += kStep_s * drive.torque_Nm / I;
    return lk_shafts_state{angle, speed, told, 0};
  };
  return growth(
      run({one_drive(B), {LK_SHAFTS_SIMULATOR, flags}, {0, speed, told, 0}}, simulator, 100));
}

/// Each step multiplies the speed by (1 − told/I).
TEST(ShaftStability, SentInertiaIsStableBelowTwiceTheRealOne) {
  const double I = 10 * armature();
  EXPECT_LT(growth_of_braked(I, I, 0), 1e-3);
  EXPECT_LT(growth_of_braked(I, armature(), 0), 1e-3);
  EXPECT_LT(growth_of_braked(I, 1.9 * I, 0), 1e-3) << "0.9^100 is 3e-5";
  EXPECT_GT(growth_of_braked(I, 2.1 * I, 0), 10) << "1.1^90 is 5313";
}

/// ω' = (1−r)·(ω + Δ), Δ' = (1−r)·Δ − r·ω with r = told/I: the limit is 4/3.
TEST(ShaftStability, LimitIsFourThirdsWithInferredTorque) {
  const double I = 10 * armature();
  EXPECT_LT(growth_of_braked(I, I, LK_SHAFTS_TORQUE_UNTOLD), 1e-3);
  EXPECT_LT(growth_of_braked(I, 1.25 * I, LK_SHAFTS_TORQUE_UNTOLD), 0.1);
  EXPECT_GT(growth_of_braked(I, 1.42 * I, LK_SHAFTS_TORQUE_UNTOLD), 10);
}

/// Without a sent inertia the armature is used, which never exceeds the real one.
TEST(ShaftStability, DefaultInertiaIsStableForAnyJoint) {
  for (const double share : {1.0, 1.1, 3.0, 30.0, 1000.0}) {
    EXPECT_LT(growth_of_braked(share * armature(), 0, 0), 1.0) << share;
  }
}

/// The simulator sends no inertia or torque for a free joint of `I_own` plus the armature. The
/// drive has a constant torque current. Returns the largest torque on the joint.
double most_torque_Nm(const model::DriveParams& drive, SimTime step, double I_own) {
  BusConfig config = test::bus_config({1});
  config.servos[0].profile.drive = drive;
  config.servos[0].boot_angle_deg = 0;
  const model::MechanicsParams& gear = drive.mechanics;
  const bool one = is_one_shaft(gear, step);
  const double armature = gear.J_out + (one ? gear.J * gear.gear_ratio * gear.gear_ratio : 0.0);
  const double h = static_cast<double>(step.count()) * 1e-9;
  lk_shafts_state now{0, 0, 0, 0};
  double most = 0;
  const auto simulator = [&](const lk_shafts_torque& given) {
    most = std::max(most, std::abs(given.torque_Nm));
    const double acceleration = given.torque_Nm / (I_own + given.armature_kg_m2);
    now.angle_rad += h * (now.speed_rad_s + 0.5 * h * acceleration);
    now.speed_rad_s += h * acceleration;
    return now;
  };
  const auto query = test::frame("141#A100000079000000");  // 121 of 2000: 2 A of 33 A
  const bool ends = !run({config, {LK_SHAFTS_SIMULATOR, 0}, now, armature, one, step, query},
                         simulator, (std::chrono::milliseconds(300) - SimTime{1}) / step)
                         .empty();
  return ends ? most : std::numeric_limits<double>::infinity();
}

/// At 2 A a lossless gear gives N·k_t·2 A. A start with backlash gives at most twice that (a
/// suddenly loaded spring).
double bound_Nm(const model::DriveParams& drive) {
  const double k_t = 1.5 * drive.motor.pole_pairs * drive.motor.psi_f;
  return 2 * drive.mechanics.gear_ratio * k_t * 2.0;
}

/// A simulator's step must be a whole number of periods of 32 kHz.
TEST(ShaftStability, DefaultsAreStableForEveryGearAndStep) {
  for (const char* const motor : {"mg4010", "mg5010", "mg8016", "mg6012-i36"}) {
    const model::DriveParams drive = test::profile(motor).drive;
    for (const double step_us : {62.5, 125.0, 250.0, 1000.0, 10'000.0}) {
      for (const double I_own : {0.0, 0.005, 0.02}) {
        const SimTime step(static_cast<std::int64_t>(step_us * 1e3));
        EXPECT_LT(most_torque_Nm(drive, step, I_own), bound_Nm(drive))
            << motor << ", " << step_us << " us, " << I_own << " kg m2";
      }
    }
  }
}

/// If the gear is so soft that the step resolves a bare output, the simulator owns the output
/// alone. With a slightly stiffer gear it does not.
TEST(ShaftStability, DefaultsAreStableAroundTheGearStiffnessLimit) {
  model::DriveParams drive = test::profile("mg5010").drive;
  const SimTime step = std::chrono::milliseconds(1);
  for (const double omega_h : {0.49, 0.55}) {
    model::MechanicsParams& gear = drive.mechanics;
    const double omega = omega_h / 1e-3;
    const double J_rotor = gear.J * gear.gear_ratio * gear.gear_ratio;
    gear.gear_stiffness_out = omega * omega / (1 / gear.J_out + 1 / J_rotor);
    gear.gear_damping_out = 0.01 * gear.gear_stiffness_out / omega;
    EXPECT_EQ(is_one_shaft(gear, step), omega_h > 0.5);
    for (const double I_own : {0.0, 0.001, 0.02}) {
      EXPECT_LT(most_torque_Nm(drive, step, I_own), bound_Nm(drive)) << omega_h << ", " << I_own;
    }
  }
}

/// A simulator that omits the armature: its joint is lighter than the drive assumes.
TEST(ShaftStability, LightJointWithoutArmatureIsUnstable) {
  const double I = 0.4 * armature();
  EXPECT_GT(growth_of_braked(I, 0, 0), 10);
}

/// A spring `k` and a damper `c` in the simulator, on the drive's shaft with a load of `J`.
double growth_on_spring(double J, double k, double c) {
  const auto simulator = [&](const lk_shafts_torque& drive) {
    return lk_shafts_state{0, 0, J, -k * drive.angle_rad - c * drive.speed_rad_s};
  };
  return growth(run({one_drive(0), {LK_SHAFTS_DRIVE, 0}, {0, 0, J, 0.1}}, simulator, 600));
}

/// [1 − h²k/2J, h − h²c/2J; −hk/J, 1 − hc/J] has a determinant of 1 − hc/J + h²k/2J, and −1 as an
/// eigenvalue at c = 2J/h.
TEST(ShaftStability, DriveOwnedJointOnASpringNeedsADamper) {
  const double J_load = 0.1;
  const double J = J_load + armature();
  const double k = 4000;
  EXPECT_GT(growth_on_spring(J_load, k, 0.5 * kStep_s * k - 1.0), 2) << "too little";
  EXPECT_LT(growth_on_spring(J_load, k, 0.5 * kStep_s * k + 1.0), 0.5);
  EXPECT_LT(growth_on_spring(J_load, k, 0.95 * 2 * J / kStep_s), 0.1);
  EXPECT_GT(growth_on_spring(J_load, k, 1.05 * 2 * J / kStep_s), 10) << "too much";
}

/// Speed equals torque times time over the sum of both inertias, for either owner: the armature is
/// reflected exactly once.
TEST(ShaftStability, ArmatureCountsOnce) {
  const double I = 5 * armature();
  double angle = 0;
  double speed = 0;
  const auto owned_by_simulator = [&](const lk_shafts_torque& drive) {
    const double acceleration = (0.3 + drive.torque_Nm) / (I + drive.armature_kg_m2);
    angle += kStep_s * (speed + 0.5 * kStep_s * acceleration);
    speed += kStep_s * acceleration;
    return lk_shafts_state{angle, speed, I + drive.armature_kg_m2, 0.3};
  };
  const auto owned_by_drive = [&](const lk_shafts_torque&) {
    return lk_shafts_state{0, 0, I, 0.3};
  };
  const double expected = 0.3 * 50 * kStep_s / (6 * armature());
  const auto simulators = run({one_drive(0), {LK_SHAFTS_SIMULATOR, 0}, {0, 0, 6 * armature(), 0.3}},
                              owned_by_simulator, 50);
  const auto drives = run({one_drive(0), {LK_SHAFTS_DRIVE, 0}, {0, 0, I, 0.3}}, owned_by_drive, 50);
  EXPECT_NEAR(simulators.back(), expected, 1e-3 * expected);
  EXPECT_NEAR(drives.back(), expected, 1e-3 * expected);
}

}  // namespace stability_test
}  // namespace lk::emulator
