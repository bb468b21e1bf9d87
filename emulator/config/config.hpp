#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config_error.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

inline constexpr int kMaxId = 32;
inline constexpr std::int64_t kDefaultBitrate = 1'000'000;
inline constexpr std::uint64_t kDefaultSeed = 1;
inline constexpr const char* kDefaultMotor = "mf7015";

/// Returns the profile of a motor, by name or path of its file. Throws UnknownMotor, or ConfigError
/// for a damaged file. A path in a configuration file is already joined to that file's directory.
using FindProfile = std::function<Profile(const std::string& motor)>;

/// Loads the body `model`, a name or a path relative to the robot file `file`. Throws
/// std::invalid_argument. Empty: the program does not support bodies.
using LoadBody = std::function<std::shared_ptr<const Mechanism>(
    const std::string& file, const std::string& model, SimTime step)>;

/// No such profile; `what()` lists the known ones.
struct UnknownMotor : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Firmware options of the command line.
struct FirmwareRequest {
  std::optional<std::string> generation;      // name, or "seen"
  std::map<std::string, std::string> quirks;  // by key of a file's `quirks`, values as given
};

/// A bus on the command line.
struct BusRequest {
  std::string interface;
  std::optional<std::vector<int>> ids;  // absent: the IDs in the configuration file
  FirmwareRequest firmware{};           // overrides that of all buses
};

/// Seed of the bus at `place` of a robot, so that buses with the same IDs differ. A bus of a file
/// keeps its place, also when it runs alone.
constexpr std::uint64_t bus_seed(std::uint64_t seed, std::size_t place) { return seed + place; }

/// Options of the command line, which override the file.
struct Overrides {
  std::vector<BusRequest> buses;
  std::optional<std::string> motor;  // of each drive: name or path
  std::optional<std::uint64_t> seed;
  std::optional<std::int64_t> bitrate;                  // of every CAN bus
  std::optional<std::int64_t> baud;                     // of every RS-485 bus
  FirmwareRequest firmware;                             // of every drive
  std::optional<double> boot_angle_deg = std::nullopt;  // of each drive
};

/// Parses "1-4" or "1,3,7-9" into ascending IDs. Throws std::invalid_argument with the reason: no
/// list, an ID outside 1..32, or a repeated ID.
std::vector<int> parse_ids(const std::string& text);

/// Returns why `name` is no valid bus name; empty if it is.
std::string interface_name_problem(const std::string& name);

/// Returns why `bitrate` is invalid; empty if valid: 0, or 10 kbit/s to 1 Mbit/s as in CAN 2.0A.
std::string bitrate_problem(std::int64_t bitrate);

/// Parses a configuration file (docs/reference/configuration.md) and applies `overrides`. Throws
/// ConfigError; std::invalid_argument if the overrides do not fit this file.
std::vector<BusConfig> parse_config(const std::string& text, const std::string& file,
                                    const Overrides& overrides, const FindProfile& find_profile,
                                    const LoadBody& load_body = {});

/// Returns the buses without a configuration file. Throws std::invalid_argument, UnknownMotor,
/// ConfigError.
std::vector<BusConfig> default_config(const Overrides& overrides, const FindProfile& find_profile);

}  // namespace lk::emulator
