#pragma once

#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_reader.hpp"

namespace lk::emulator {

/// What the command line says of the drives of one bus.
struct AskedOfBus {
  std::string interface;                 // as it is called there
  std::optional<std::vector<int>> ids;   // of the drives that run; absent: all of the file
  FirmwareRequest firmware{};            // of those
  const SerialConfig* serial = nullptr;  // of an RS-485 bus
  std::int64_t bitrate = 0;              // the same
  const Mechanism* body = nullptr;       // of the robot
  std::optional<double> boot_angle_deg = std::nullopt;
};

/// A drive of which no file says anything. Throws std::invalid_argument, ConfigError.
ServoConfig make_servo(int id, const Profile& profile, const AskedOfBus& asked);

/// The servos of one [[bus.drive]].
std::vector<ServoConfig> read_drive(TableReader& reader, const Overrides& overrides,
                                    const AskedOfBus& asked, const FindProfile& find);

}  // namespace lk::emulator
