// Every shipped profile does what its vendor prints, and what its own numbers say.
#include <map>

#include "tests/model/profiles.hpp"

namespace lk::model::test {
namespace profile_test {

/// No-load speed at the output, rpm, and supply voltage, as the vendors print them. MG6012-i36: not
/// printed.
const std::map<std::string, double> kPrintedNoLoadRpm{
    {"ms3506", 2100},   {"mf5010", 3050}, {"mf7015", 1895}, {"mf7015-23t", 805}, {"mf9025", 710},
    {"mh9025", 280},    {"mg4005", 320},  {"mg4010", 320},  {"mg5010", 320},     {"mg6010", 505},
    {"mg6012-i8", 310}, {"mg8008", 220},  {"mg8016", 300}};

TEST(Profiles, RunFreeAtThePrintedSpeed) {
  std::size_t checked = 0;
  for (const std::vector<NamedDrive>& group : profiles_by_rate()) {
    DriveBank bank = bank_of(group);
    for (std::size_t n = 0; n < group.size(); ++n) {
      ControlSettings settings = group[n].init.settings;
      settings.omega_max = 1e4;
      bank.configure(n, settings);
      // Two and a half times the torque of friction: nothing but the voltage limits the speed.
      const DriveParams& d = group[n].init.params;
      bank.command(n, Torque{2.5 * d.mechanics.tau_coulomb / k_t(d.motor)});
    }
    bank.advance(ticks_in(group.front().init.params, 4.0));
    for (std::size_t n = 0; n < group.size(); ++n) {
      const auto printed = kPrintedNoLoadRpm.find(group[n].name);
      if (printed == kPrintedNoLoadRpm.end()) {
        continue;
      }
      ++checked;
      const double rpm = bank.truth(n).omega_out * 60.0 / (2.0 * kPiT);
      EXPECT_NEAR(rpm, printed->second, 0.03 * printed->second) << group[n].name;  // required: 3 %
    }
  }
  EXPECT_EQ(checked, kPrintedNoLoadRpm.size());
}

TEST(Profiles, CoverEveryRowOfTheTable) {
  std::vector<std::string> names;
  for (const NamedDrive& drive : all_profiles()) {
    names.push_back(drive.name);
  }
  for (const auto& [name, rpm] : kPrintedNoLoadRpm) {
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
  }
  EXPECT_NE(std::find(names.begin(), names.end(), "mg6012-i36"), names.end());
}

}  // namespace profile_test
}  // namespace lk::model::test
