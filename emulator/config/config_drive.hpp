#pragma once

#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_reader.hpp"

namespace lk::emulator {

/// Command-line options for the drives of one bus, and properties of that bus.
struct BusOptions {
  std::string interface;  // bus name: as on the command line, otherwise as in the file
  std::optional<std::vector<int>> ids;   // IDs of the drives that run; absent: all in the file
  FirmwareRequest firmware{};            // of these drives
  const SerialConfig* serial = nullptr;  // parameters of an RS-485 bus; null: CAN
  std::int64_t bitrate = 0;              // of the bus
  const Mechanism* body = nullptr;       // body of the robot; null: none
  std::optional<double> boot_angle_deg = std::nullopt;
};

/// Makes a drive that no configuration file contains. Throws std::invalid_argument, ConfigError.
ServoConfig make_servo(int id, const Profile& profile, const BusOptions& bus_options);

/// Reads the servos of one [[bus.drive]].
std::vector<ServoConfig> read_drive(TableReader& reader, const Overrides& overrides,
                                    const BusOptions& bus_options, const FindProfile& find);

}  // namespace lk::emulator
