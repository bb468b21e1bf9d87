#pragma once

#include <span>
#include <string>

#include "emulator/bus_config.hpp"
#include "emulator/config_reader.hpp"

namespace lk::emulator {

/// Parses a motor file (docs/configuration.md). Throws ConfigError.
Profile parse_profile(const std::string& text, const std::string& file, const std::string& name);

/// Reads the sections of a profile, [motor] [inverter] [mechanics] …, into `params`.
void read_drive_params(TableReader& reader, Presence presence, model::DriveParams& params);

/// Reads [load], what hangs on the output shaft; every key is optional.
void read_load(TableReader& reader, model::LoadParams& load);

/// Reads registers: [factory] of a profile, [settings] of a drive.
void read_registers(TableReader& reader, Presence presence, Registers& registers);

}  // namespace lk::emulator
