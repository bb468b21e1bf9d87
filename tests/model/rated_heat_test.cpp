// A winding at its rated torque has the temperature of its motor file (docs/internals/model.md §6).
#include "tests/model/profiles.hpp"
#include "tests/support/profile.hpp"

namespace lk::model::test {
namespace rated_heat_test {

constexpr double kOmega = 1.0;  // rad/s at the rotor: friction hardly warms the housing

struct RatedDrive {
  std::string name;
  DriveInit init;
  double friction;   // K, added by friction of bearings and gear at this speed
  double tolerance;  // K
};

/// The drives whose thermal resistances were set for 90 °C, against their rated torque. Small heat
/// capacities make them reach the final temperature quickly.
std::vector<RatedDrive> rated_drives() {
  std::vector<RatedDrive> drives;
  for (const NamedDrive& drive : all_profiles()) {
    std::ifstream file(LKEMU_SOURCE_DIR "/configs/motors/" + drive.name + ".toml");
    std::stringstream text;
    text << file.rdbuf();
    if (text.str().find("90 C at the rated torque") == std::string::npos) {
      continue;
    }
    const double torque = lk::test::profile(drive.name).rating.torque_rated_Nm;
    RatedDrive rated{drive.name, drive.init, 0.0, 0.0};
    DriveParams& d = rated.init.params;
    d.load.tau = -torque;
    d.thermal.C_winding = d.thermal.C_housing = 0.02;
    // No protection trips meanwhile, and no ramp limits the current.
    rated.init.settings.protections = {};
    rated.init.settings.current_ramp = 0.0;
    // The rule knows no texture, and the winding would follow its ripple at this speed.
    d.mechanics.tau_cogging = d.mechanics.tau_cogging_3 = d.mechanics.tau_pole_cogging = 0.0;
    d.motor.torque_ripple = 0.0;
    d.current_sensor.offset_a = d.current_sensor.offset_b = d.current_sensor.noise = 0.0;
    // Three digits are accurate to 0.5 %, and the rule ignores viscous friction. Heat is the square
    // of the current. ΔT = 65 K·(1 + ε)·g(T), with g = resistance over flux squared. g grows by
    // α_cu/1.2555 + 2·0.0011/0.9285 = 0.0055 per K: this amplifies errors by 1/(1 − 65·0.0055).
    const double viscous =
        d.mechanics.B * kOmega * d.mechanics.gear_ratio * d.mechanics.gear_efficiency / torque;
    const MechanicsParams& m = d.mechanics;
    const double tau_friction =
        m.tau_coulomb + ((torque + m.tau_coulomb_out) / m.gear_efficiency - torque) / m.gear_ratio;
    rated.friction = d.thermal.R_housing_ambient * tau_friction * kOmega / (1.0 - 65.0 * 0.0055);
    rated.tolerance = 65.0 * (0.005 + 2.0 * viscous) / (1.0 - 65.0 * 0.0055);
    drives.push_back(rated);
  }
  return drives;
}

TEST(RatedHeat, IsNinetyDegreesAtTheRatedTorque) {
  const std::vector<RatedDrive> drives = rated_drives();
  ASSERT_FALSE(drives.empty());
  std::vector<DriveInit> inits;
  for (const RatedDrive& drive : drives) {
    inits.push_back(drive.init);
  }
  DriveBank bank(inits);
  for (std::size_t n = 0; n < drives.size(); ++n) {
    bank.command(n, Speed{kOmega});
  }
  // The slower of the two time constants is below 0.02 J/K·(2·R_ha + R_wh)/(1 − 0.36) = 0.13 s.
  bank.advance(ticks_in(drives.front().init.params, 1.5));
  for (std::size_t n = 0; n < drives.size(); ++n) {
    EXPECT_NEAR(bank.truth(n).omega_m, kOmega, 0.5) << drives[n].name;
    EXPECT_NEAR(bank.truth(n).temp_winding, 90.0 + drives[n].friction, drives[n].tolerance)
        << drives[n].name;
    EXPECT_LT(drives[n].tolerance, 1.0) << drives[n].name;
  }
}

}  // namespace rated_heat_test
}  // namespace lk::model::test
