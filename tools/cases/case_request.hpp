#pragma once

/// @file Reads a case from one line of JSON (docs/reference/formats.md).

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/files/json_table.hpp"

namespace lk::emulator {

/// Values that replace the values of all drives. Keys contain the units.
struct CaseSettings {
  toml::table supply;   // empty, or `supply_V` as in an [[event]]
  toml::table ambient;  // empty, or `ambient_C` as in an [[event]]
  toml::table load;     // keys of a load
  double bus_load = 0;  // 0..0.95, share of the time that added frames occupy each CAN bus
};

/// A case: a scenario with changes, and at most one fault.
struct CaseRequest {
  std::uint64_t number = 0;
  std::string scenario;  // path, or name of a shipped scenario
  std::string group;     // equal for cases that differ only in number and fault
  toml::table keys;      // seed, bitrate, generation; those that the case has
  CaseSettings settings;
  toml::array directives;                 // [[event]] tables added to the scenario
  std::vector<std::string> drive_errors;  // error bits to watch on every drive
  toml::array detect;                     // [[expect]] tables for symptoms that a host can notice
  std::optional<toml::table> fault;       // [[event]] table that sets the fault
};

/// Reads the number of a case. Throws JsonError.
std::uint64_t read_case_number(const Json& line);
/// Reads a case. Throws JsonError or ConfigError.
CaseRequest read_case(const Json& line);

}  // namespace lk::emulator
