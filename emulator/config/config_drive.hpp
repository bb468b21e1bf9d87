#pragma once

#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_reader.hpp"

namespace lk::emulator {

/// Options of the command line for the drives of one bus.
struct BusOptions {
  std::string interface;                 // as named there
  std::optional<std::vector<int>> ids;   // of the drives that run; absent: all of the file
  FirmwareRequest firmware{};            // of these drives
  const SerialConfig* serial = nullptr;  // null unless RS-485
  std::int64_t bitrate = 0;              // of the bus
  const Mechanism* body = nullptr;       // of the robot
  std::optional<double> boot_angle_deg = std::nullopt;
};

/// Makes a drive that is in no file. Throws std::invalid_argument, ConfigError.
ServoConfig make_servo(int id, const Profile& profile, const BusOptions& bus_options);

/// Reads the servos of one [[bus.drive]].
std::vector<ServoConfig> read_drive(TableReader& reader, const Overrides& overrides,
                                    const BusOptions& bus_options, const FindProfile& find);

}  // namespace lk::emulator
