#pragma once

/// @file From a requested case to a scenario that can run, and TOML as text with the shortest
/// numbers that read back the same (toml++ writes 0.1 as 0.10000000000000001).

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/scenario/scenario.hpp"
#include "tools/cases/case_files.hpp"
#include "tools/cases/case_request.hpp"

namespace lk::emulator {

/// A file: keys, then `[[…]]` for each array of tables. All tables within these are on one line.
std::string toml_text(const toml::table& document);

/// The keys of a table, a line each: `reply = { error = "stall" }`.
std::string toml_lines(const toml::table& table);

/// A directive for one of a robot's buses.
struct PlannedDirective {
  std::size_t bus = 0;
  TimedDirective directive;
};

/// The part that all cases of a group share: everything but the fault.
/// Expectations are in this order: the scenario's own, then one for each watched error bit of each
/// drive, then those of `detect`.
struct CaseCourse {
  Scenario scenario;
  std::size_t own = 0;
  std::size_t drive_errors = 0;
  std::uint64_t inputs = 0;  // a hash of the files that the scenario names, and of itself
  /// Place of each expectation in Verdict::expectations, which is sorted by bus.
  std::vector<std::size_t> places;
};

/// Builds cases and keeps the files that they name. For one thread.
class CaseBuilder {
 public:
  /// Throws ConfigError, JsonError or std::invalid_argument.
  CaseCourse course(const CaseRequest& request);
  /// Empty if the case has no fault. Throws ConfigError if the drive cannot have this fault.
  static std::vector<PlannedDirective> fault(const CaseRequest& request, const Scenario& scenario);
  /// The case with its fault, and what is watched as expectations behind its own, as a scenario
  /// file for any directory. Throws as `course`.
  std::string file_text(const CaseRequest& request);

 private:
  struct Base {
    std::filesystem::path file;
    std::uint64_t hash;  // of its text
    toml::table document;
    std::unique_ptr<CaseFiles> files;
  };
  Base& base_of(const std::string& scenario);
  static toml::table changed(const CaseRequest& request, Base& base);

  std::map<std::string, Base> bases_;
};

}  // namespace lk::emulator
