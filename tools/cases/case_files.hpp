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

/// Files that the scenarios of a campaign name. Reads each file once.
class CaseFiles {
 public:
  /// Relative file names are relative to `directory`, that of the base scenario.
  explicit CaseFiles(std::filesystem::path directory) : directory_(std::move(directory)) {}
  CaseFiles(const CaseFiles&) = delete;
  CaseFiles& operator=(const CaseFiles&) = delete;

  /// Returns the file access for parse_scenario. It refers to this object.
  ScenarioFiles files();
  /// Returns a hash of all files read so far, independent of their order.
  std::uint64_t hash() const;

 private:
  /// Name, generation and bit rate of a robot. Robots are cached without their seeds.
  using RobotKey = std::tuple<std::string, std::string, std::int64_t>;

  const std::string& text(const std::filesystem::path& file, std::uintmax_t longest);
  std::vector<BusConfig> robot(const std::string& name, const Overrides& overrides);

  std::filesystem::path directory_;
  std::map<std::filesystem::path, std::string> texts_;
  std::map<std::string, MotorFile> motors_;
  std::map<RobotKey, std::vector<BusConfig>> robots_;
};

/// Returns the FNV-1a hash with 64 bits. It detects changed inputs, but not intended collisions.
std::uint64_t text_hash(std::string_view text, std::uint64_t so_far = 0xCBF29CE484222325U);

}  // namespace lk::emulator
