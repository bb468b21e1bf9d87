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

/// Gives the profile of a motor, by its name or by the path of its file; throws UnknownMotor, or
/// ConfigError when its file is damaged. A path in a configuration file comes joined to the
/// directory of that file.
using FindProfile = std::function<Profile(const std::string& motor)>;

/// Gives the body that `model` names in the robot file `file`: a path from there, or a bare name.
/// Throws std::invalid_argument. None: the program has no bodies.
using LoadBody = std::function<std::shared_ptr<const Mechanism>(
    const std::string& file, const std::string& model, SimTime step)>;

/// There is no such profile; `what()` says which there are.
struct UnknownMotor : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What the command line says of how drives speak.
struct FirmwareRequest {
  std::optional<std::string> generation;      // its name, or "seen"
  std::map<std::string, std::string> quirks;  // values by the keys of a file's `quirks`, as given
};

/// One bus as the command line asks for it.
struct BusRequest {
  std::string interface;
  std::optional<std::vector<int>> ids;  // absent: those the configuration file gives it
  FirmwareRequest firmware{};           // wins over that of all buses
};

/// Of the bus at `place` of a robot. Two buses with the same IDs must not be copies of each other.
/// A bus of a file keeps its place there, also when it runs alone.
constexpr std::uint64_t bus_seed(std::uint64_t seed, std::size_t place) { return seed + place; }

/// What the command line says; it wins over the file.
struct Overrides {
  std::vector<BusRequest> buses;
  std::optional<std::string> motor;  // of every drive: name or path
  std::optional<std::uint64_t> seed;
  std::optional<std::int64_t> bitrate;                  // of every CAN bus
  std::optional<std::int64_t> baud;                     // of every RS-485 bus
  FirmwareRequest firmware;                             // of every drive
  std::optional<double> boot_angle_deg = std::nullopt;  // the same
};

/// "1-4", "1,3,7-9": ascending. Throws std::invalid_argument with the reason: not a list, an ID
/// outside 1..32, one given twice.
std::vector<int> parse_ids(const std::string& text);

/// Why `name` cannot be an interface's, nor an RS-485 bus's; empty when it can.
std::string interface_name_problem(const std::string& name);

/// Why `bitrate` cannot be a bus's; empty when it can: 0, or 10 kbit/s to 1 Mbit/s as CAN 2.0A has.
std::string bitrate_problem(std::int64_t bitrate);

/// Parses a configuration file (docs/configuration.md) and applies `overrides`. Throws ConfigError;
/// when what the overrides ask for cannot be had from this file, std::invalid_argument.
std::vector<BusConfig> parse_config(const std::string& text, const std::string& file,
                                    const Overrides& overrides, const FindProfile& find_profile,
                                    const LoadBody& load_body = {});

/// The buses when there is no configuration file. Throws std::invalid_argument, UnknownMotor,
/// ConfigError.
std::vector<BusConfig> default_config(const Overrides& overrides, const FindProfile& find_profile);

}  // namespace lk::emulator
