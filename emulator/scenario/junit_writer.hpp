#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "emulator/core/scenario_run.hpp"

namespace lk::emulator {

/// A scenario that has been run.
struct RunReport {
  std::string name;
  std::string about;
  std::uint64_t seed = 0;
  std::size_t drives = 0;
  SimTime simulated{0};
  double wall_s = 0;
  Verdict verdict;
};

/// JUnit XML as CI systems read it: a suite for each run, a case for each expectation and each
/// planned fault. `hostname`s and time stamps are left out: two runs give the same but `time`.
std::string junit_xml(const std::vector<RunReport>& reports);

}  // namespace lk::emulator
