#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/motor_file.hpp"
#include "emulator/config/scenario/scenario_file.hpp"

namespace lk::emulator {

/// The files that the scenarios of a campaign name: each is read once, and goes into `hash`.
class CaseFiles {
 public:
  /// `directory` is that of the base scenario.
  explicit CaseFiles(std::filesystem::path directory) : directory_(std::move(directory)) {}
  CaseFiles(const CaseFiles&) = delete;
  CaseFiles& operator=(const CaseFiles&) = delete;

  /// For parse_scenario; refers to this.
  ScenarioFiles files();
  /// Hash of all files read so far, independent of their order.
  std::uint64_t hash() const;

 private:
  /// A robot by its name, generation and bit rate; seeds are put in afterwards.
  using RobotKey = std::tuple<std::string, std::string, std::int64_t>;

  const std::string& text(const std::filesystem::path& file, std::uintmax_t longest);
  std::vector<BusConfig> robot(const std::string& name, const Overrides& overrides);

  std::filesystem::path directory_;
  std::map<std::filesystem::path, std::string> texts_;
  std::map<std::string, MotorFile> motors_;
  std::map<RobotKey, std::vector<BusConfig>> robots_;
};

/// FNV-1a with 64 bits: to tell one input from another, not from whoever wants them the same.
std::uint64_t text_hash(std::string_view text, std::uint64_t so_far = 0xCBF29CE484222325U);

}  // namespace lk::emulator
