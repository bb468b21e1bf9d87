#pragma once

#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Why an encoder offset does not fit an encoder; empty when it does.
std::string offset_problem(std::uint16_t offset, const model::EncoderParams& encoder);
/// Why a drive of this series cannot have this control; empty when it can.
std::string control_problem(Series series, const model::ControlParams& control);
/// Why these two make no sense together; empty when they do.
std::string voltage_problem(const Registers& registers);

/// Numbers of a motor with which the equations of the model hold no more (docs/model.md).
struct ModelProblem {
  std::vector<std::string> keys;  // of a motor file, with their sections; the likeliest first
  std::string reason;
};
std::optional<ModelProblem> model_problem(const model::DriveParams& drive);

/// Refuses registers that the drive cannot hold or that make no sense together. `reader` has them
/// as its table `settings`. Throws ConfigError.
void check_settings(const TableReader& reader, const ServoConfig& servo);

/// Refuses what the keys of a drive, each good by itself, make no sense of together. `reader` is
/// that of its [[bus.drive]]. Throws ConfigError.
void check_drive(TableReader& reader, const ServoConfig& servo);

}  // namespace lk::emulator
