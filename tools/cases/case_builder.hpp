#pragma once

/// @file Builds scenarios that can run from requested cases. Writes TOML with the shortest numbers
/// that read back the same (toml++ writes 0.1 as 0.10000000000000001).

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

/// Returns a TOML file: the keys, then `[[…]]` for each table of the arrays of tables. Other tables
/// are written on one line.
std::string toml_text(const toml::table& document);

/// Returns the keys of a table, one line for each: `reply = { error = "stall" }`.
std::string toml_lines(const toml::table& table);

/// A directive for the bus with index `bus` of a robot.
struct PlannedDirective {
  std::size_t bus = 0;
  TimedDirective directive;
};

/// Scenario without the fault: the part that all cases of a group share. Its expectations, in
/// order: those of the scenario file; one for each watched error bit of each drive; those in
/// `detect`.
struct CaseCourse {
  Scenario scenario;
  std::size_t own = 0;           // number of expectations of the scenario file
  std::size_t drive_errors = 0;  // number of expectations for error bits
  std::uint64_t inputs = 0;      // hash of the scenario file and of the files that it names
  /// Index of each expectation in Verdict::expectations, which is sorted by bus.
  std::vector<std::size_t> places;
};

/// Builds cases and caches the files that they name. Not thread-safe.
class CaseBuilder {
 public:
  /// Builds the scenario of a case, without the fault of the case. Throws ConfigError, JsonError
  /// or std::invalid_argument.
  CaseCourse course(const CaseRequest& request);
  /// Returns the directives that set the fault of a case; empty without a fault. Throws ConfigError
  /// if the drive cannot have this fault.
  static std::vector<PlannedDirective> fault(const CaseRequest& request, const Scenario& scenario);
  /// Returns the case with its fault as a scenario file that works in any directory. The watched
  /// error bits and `detect` become expectations after those of the scenario. Throws as `course`.
  std::string file_text(const CaseRequest& request);

 private:
  struct Base {
    std::filesystem::path file;
    std::uint64_t hash;  // of the file's text
    toml::table document;
    std::unique_ptr<CaseFiles> files;
  };
  Base& base_of(const std::string& scenario);
  static toml::table changed(const CaseRequest& request, Base& base);

  std::map<std::string, Base> bases_;
};

}  // namespace lk::emulator
