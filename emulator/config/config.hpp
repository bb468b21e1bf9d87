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
/// for a damaged file. If the path comes from a configuration file, the caller has joined it to the
/// directory of that file.
using FindProfile = std::function<Profile(const std::string& motor)>;

/// Loads the body `model`, a name or a path relative to the robot file `file`. Throws
/// std::invalid_argument. Empty: the program does not support bodies.
using LoadBody = std::function<std::shared_ptr<const Mechanism>(
    const std::string& file, const std::string& model, SimTime step)>;

/// Thrown if no profile of the motor can be read; `what()` gives the reason, e.g. with the known
/// names.
struct UnknownMotor : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Firmware options of the command line.
struct FirmwareRequest {
  std::optional<std::string> generation;      // name, or "seen"
  std::map<std::string, std::string> quirks;  // values as given, by key of [quirks]
};

/// A bus on the command line.
struct BusRequest {
  std::string interface;
  std::optional<std::vector<int>> ids;  // absent: the IDs in the configuration file
  FirmwareRequest firmware{};           // overrides Overrides::firmware
};

/// Returns the seed of the bus with index `place` in its robot: drives with the same ID on two
/// buses must differ. A bus of a file keeps its index in the file, also when it runs alone.
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

/// Parses "1-4" or "1,3,7-9" into ascending IDs. Throws std::invalid_argument with the reason:
/// `text` is not a list, an ID is outside 1..32, or an ID is repeated.
std::vector<int> parse_ids(const std::string& text);

/// Returns why `name` is no valid bus name; empty if it is.
std::string interface_name_problem(const std::string& name);

/// Returns why `bitrate` is invalid; empty if valid: 0, or 10 kbit/s to 1 Mbit/s as in CAN 2.0A.
std::string bitrate_problem(std::int64_t bitrate);

/// Parses a configuration file (docs/reference/configuration.md) and applies `overrides`. Throws
/// ConfigError; std::invalid_argument if `overrides` does not fit this file.
std::vector<BusConfig> parse_config(const std::string& text, const std::string& file,
                                    const Overrides& overrides, const FindProfile& find_profile,
                                    const LoadBody& load_body = {});

/// Returns the buses that `overrides` requests, without a configuration file. Throws
/// std::invalid_argument, UnknownMotor, ConfigError.
std::vector<BusConfig> default_config(const Overrides& overrides, const FindProfile& find_profile);

}  // namespace lk::emulator
