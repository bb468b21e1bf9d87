#pragma once

/// @file A plan from its [dimension]s, and results of its cases as text.

#include <filesystem>
#include <string>
#include <vector>

#include "tools/campaign/plan/plan_file.hpp"
#include "tools/campaign/plan/sampling.hpp"
#include "tools/campaign/results/canonical.hpp"
#include "tools/campaign/run/offline.hpp"

namespace lk::test {

inline const std::filesystem::path kHere =
    std::filesystem::path(LKEMU_SOURCE_DIR) / "tests/tools/campaign/run";

/// On a scenario beside this file, or a shipped one; `rest`: what stands before [dimension].
inline emulator::Plan plan_of(const std::string& scenario, const std::string& dimensions,
                              const std::string& rest = "") {
  return emulator::parse_plan(
      "scenario = \"" + scenario + "\"\n" + rest + "\n[dimension]\n" + dimensions,
      kHere / "plan.toml");
}

inline std::vector<emulator::CaseToRun> cases_of(const emulator::Plan& plan,
                                                 const std::vector<std::uint64_t>& numbers) {
  const emulator::CaseNumbers all(plan);
  std::vector<emulator::CaseToRun> cases;
  for (const std::uint64_t number : numbers) {
    if (auto values = all.values(number)) cases.push_back({number, 0, std::move(*values)});
  }
  return cases;
}

/// All but the wall clock.
inline std::vector<std::string> texts_of(const std::vector<emulator::CaseResult>& results) {
  std::vector<std::string> texts;
  for (const emulator::CaseResult& one : results) texts.push_back(canonical_line(one));
  return texts;
}

}  // namespace lk::test
