#pragma once

#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Returns why an encoder offset does not fit the encoder; empty if it does.
std::string offset_problem(std::uint16_t offset, const model::EncoderParams& encoder);
/// Returns why drives of this series cannot have these control parameters; empty if they can.
std::string control_problem(Series series, const model::ControlParams& control);
/// Returns why the two voltage thresholds conflict; empty if they do not.
std::string voltage_problem(const Registers& registers);

/// Motor values that violate assumptions of the model's equations (docs/internals/model.md).
struct ModelProblem {
  std::vector<std::string> keys;  // keys of a motor file: "motor.L_q_mH"; most likely cause first
  std::string reason;
};
std::optional<ModelProblem> model_problem(const model::DriveParams& drive);

/// Rejects registers that the drive cannot hold or that conflict. `reader` is that of the table
/// that contains `settings`. Throws ConfigError.
void check_settings(const TableReader& reader, const model::DriveParams& drive,
                    const Registers& registers);

/// Rejects keys of a drive that are valid alone but conflict. `reader` is that of its
/// [[bus.drive]]. Throws ConfigError.
void check_drive(TableReader& reader, const ServoConfig& servo);

}  // namespace lk::emulator
