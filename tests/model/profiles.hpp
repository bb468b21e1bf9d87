#pragma once

/// @file The shipped motor profiles as inputs of the model.

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "emulator/core/servo/registers.hpp"
#include "tests/model/support.hpp"
#include "tests/support/profile.hpp"

namespace lk::model::test {

struct NamedDrive {
  std::string name;
  DriveInit init;
};

inline std::vector<NamedDrive> all_profiles() {
  std::vector<NamedDrive> drives;
  for (const auto& entry :
       std::filesystem::directory_iterator(LKEMU_SOURCE_DIR "/configs/motors")) {
    if (entry.path().extension() != ".toml") {
      continue;
    }
    const std::string name = entry.path().stem().string();
    const emulator::Profile profile = lk::test::profile(name);
    drives.push_back(
        {name,
         {profile.drive, emulator::control_settings(profile.factory), drives.size() + 1, 0.0}});
  }
  std::sort(drives.begin(), drives.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  return drives;
}

/// Groups profiles by PWM frequency, since a bank has only one.
inline std::vector<std::vector<NamedDrive>> profiles_by_rate() {
  std::vector<std::vector<NamedDrive>> groups;
  for (const NamedDrive& drive : all_profiles()) {
    const auto fits = [&drive](const auto& group) {
      return group.front().init.params.inverter.f_pwm == drive.init.params.inverter.f_pwm;
    };
    const auto group = std::find_if(groups.begin(), groups.end(), fits);
    if (group == groups.end()) {
      groups.push_back({drive});
    } else {
      group->push_back(drive);
    }
  }
  return groups;
}

inline DriveBank bank_of(const std::vector<NamedDrive>& drives) {
  std::vector<DriveInit> inits;
  for (const NamedDrive& drive : drives) {
    inits.push_back(drive.init);
  }
  return DriveBank(inits);
}

}  // namespace lk::model::test
