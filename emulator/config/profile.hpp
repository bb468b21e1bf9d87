#pragma once

#include <cstdint>
#include <string>

#include "emulator/config/config_error.hpp"
#include "emulator/config/motor_file.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

// Declared here, as config_reader.hpp includes toml++.
class TableReader;
enum class Presence : std::uint8_t;

/// Parses a motor file (docs/reference/configuration.md); `find_base` finds the files that it
/// extends. Throws ConfigError.
Profile parse_profile(const MotorFile& motor, const FindMotorFile& find_base);
/// For a file that extends no other.
Profile parse_profile(const std::string& text, const std::string& file, const std::string& name);

/// Reads the sections [motor] [inverter] [mechanics] … into `params`. [brake] is always optional:
/// no brake.
void read_drive_params(TableReader& reader, Presence presence, model::DriveParams& params);

/// Reads [load], the load on the output shaft; all keys are optional.
void read_load(TableReader& reader, model::LoadParams& load);

/// Properties of a drive that decide the ranges of its registers.
struct RegisterRules {
  Series series = Series::kMf;  // MS has Max Power instead of Max Torque Current
  int iq_limit_lsb = protocol::kLegacyDialect.iq_command_limit_lsb;
  bool wide_gains = false;  // 16 bits and Kd (0xC1); otherwise bytes
};

/// Reads [factory] of a profile or [settings] of a drive.
void read_registers(TableReader& reader, Presence presence, const RegisterRules& rules,
                    Registers& registers);
/// Reads [protection] of these.
void read_protections(TableReader& reader, Presence presence, Registers& registers);

}  // namespace lk::emulator
