#pragma once

/// @file A case as one line of JSON (docs/reference/formats.md).

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/files/json_table.hpp"

namespace lk::emulator {

/// Values that replace those of all drives, or of the whole bus. Units are in the keys.
struct CaseSettings {
  toml::table supply;   // `supply_V` or nothing, as in an [[event]]
  toml::table ambient;  // `ambient_C`
  toml::table load;     // keys of a load
  double bus_load = 0;  // share of the wire that other frames take, 0 to 0.95
};

/// A scenario with changes, and at most one fault.
struct CaseRequest {
  std::uint64_t number = 0;
  std::string scenario;  // path or name of a delivered one
  std::string group;     // equal for cases that differ in nothing but number and fault
  toml::table keys;      // seed, bitrate, generation
  CaseSettings settings;
  toml::array directives;                 // [[event]] tables
  std::vector<std::string> drive_errors;  // error bits to watch on every drive
  toml::array detect;                     // [[expect]] tables of what a host would notice
  std::optional<toml::table> fault;       // an [[event]] table with a fault
};

/// The number of the case. Throws JsonError.
std::uint64_t read_case_number(const Json& line);
/// Throws JsonError or ConfigError.
CaseRequest read_case(const Json& line);

}  // namespace lk::emulator
