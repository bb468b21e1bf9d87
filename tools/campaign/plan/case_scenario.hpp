#pragma once

/// @file What a case is: the base scenario with its values put in.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/scenario/scenario.hpp"
#include "tools/cases/case_builder.hpp"
#include "tools/campaign/plan/plan.hpp"

namespace lk::emulator {

/// What is looked at besides what the scenario expects: behind its own expectations, in this order.
struct Watched {
  std::size_t own = 0;    // expectations of the scenario
  std::size_t drive = 0;  // then these: an error bit of a drive is set
  std::size_t host = 0;   // then these: what a host would notice
};

/// All cases that differ in nothing but their fault.
struct CaseGroup {
  Scenario scenario;  // without the fault, with what is watched
  Watched watched;
  // Where the verdict has the n-th expectation: buses come one after the other.
  std::vector<std::size_t> order;
  std::vector<bool> hazardous;  // of the scenario's own
  // Of what is watched of hosts: it fires by failing (`answered`), and not by coming about.
  std::vector<bool> fires_by_failing;
};

class CaseScenarios {
 public:
  /// `plan` must outlive this. Throws ConfigError.
  explicit CaseScenarios(const Plan& plan);

  /// Tells the values of one group from those of another.
  std::string group_key(const CaseValues& values) const;
  /// Throws ConfigError: the values make no scenario.
  CaseGroup group(const CaseValues& values);
  /// Throws ConfigError: such a drive cannot have this fault. Empty: the plan has no fault.
  std::vector<PlannedDirective> fault(const CaseValues& values, const Scenario& scenario) const;
  /// What a running lk-emu is told on its command line.
  struct Keys {
    std::string robot;  // an absolute path, or the name of a shipped one
    std::optional<std::uint64_t> seed;
    std::optional<std::int64_t> bitrate;
    std::optional<std::string> generation;
  };
  Keys keys(const CaseValues& values);
  /// The values without those of the fault.
  CaseValues without_fault(const CaseValues& values) const;
  /// The whole case as a scenario file, wherever that stands; `watched`: with what is looked
  /// at besides.
  std::string file_text(const CaseValues& values, bool watched);

 private:
  toml::table document(const CaseValues& values, bool watched);
  void vary_surroundings(const CaseValues& values, const Scenario& plain, toml::array& events);
  toml::table fault_event(const CaseValues& values) const;

  const Plan& plan_;
  CaseFiles files_;
  toml::table base_;
};

}  // namespace lk::emulator
