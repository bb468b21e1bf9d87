#pragma once

#include <cstdint>
#include <string>

#include "emulator/config/config_error.hpp"
#include "emulator/config/motor_file.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

// In config_reader.hpp, with toml++.
class TableReader;
enum class Presence : std::uint8_t;

/// Parses a motor file (docs/configuration.md); `find_base` gives those that it extends. Throws
/// ConfigError.
Profile parse_profile(const MotorFile& motor, const FindMotorFile& find_base);
/// One that extends no other.
Profile parse_profile(const std::string& text, const std::string& file, const std::string& name);

/// Reads the sections of a profile, [motor] [inverter] [mechanics] …, into `params`. [brake] may be
/// left out in any case: no brake.
void read_drive_params(TableReader& reader, Presence presence, model::DriveParams& params);

/// Reads [load], what hangs on the output shaft; every key is optional.
void read_load(TableReader& reader, model::LoadParams& load);

/// What the drive makes of its registers' ranges.
struct RegisterRules {
  Series series = Series::kMf;  // MS: Max Power in place of Max Torque Current
  int iq_limit_lsb = protocol::kLegacyDialect.iq_command_limit_lsb;
  bool wide_gains = false;  // 16 bits and Kd (0xC1), else bytes
};

/// Reads registers: [factory] of a profile, [settings] of a drive.
void read_registers(TableReader& reader, Presence presence, const RegisterRules& rules,
                    Registers& registers);

}  // namespace lk::emulator
