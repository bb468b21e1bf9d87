#pragma once

#include <cstdint>
#include <string>

#include "emulator/config/config_error.hpp"
#include "emulator/config/motor_file.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

// Forward declarations: config_reader.hpp would include toml++.
class TableReader;
enum class Presence : std::uint8_t;

/// Parses a motor file (docs/reference/configuration.md); `find_base` finds the files that it
/// extends. Throws ConfigError.
Profile parse_profile(const MotorFile& motor, const FindMotorFile& find_base);
/// Parses a motor file that extends no other one.
Profile parse_profile(const std::string& text, const std::string& file, const std::string& name);

/// Reads the sections [motor] [inverter] [mechanics] … into `params`. [brake] is always optional;
/// without it, the drive has no brake.
void read_drive_params(TableReader& reader, Presence presence, model::DriveParams& params);

/// Reads [load], the load on the output shaft; all keys are optional.
void read_load(TableReader& reader, model::LoadParams& load);

/// Properties of a drive that decide the ranges of its registers.
struct RegisterRules {
  Series series = Series::kMf;  // MS has Max Power instead of Max Torque Current
  int iq_limit_lsb = protocol::kLegacyDialect.iq_command_limit_lsb;
  bool wide_gains = false;  // gains have 16 bits and Kd (0xC1); otherwise 8 bits
};

/// Reads [factory] of a profile or [settings] of a drive.
void read_registers(TableReader& reader, Presence presence, const RegisterRules& rules,
                    Registers& registers);
/// Reads [protection] inside [factory] or [settings].
void read_protections(TableReader& reader, Presence presence, Registers& registers);

}  // namespace lk::emulator
