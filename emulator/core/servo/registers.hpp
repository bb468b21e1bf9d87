#pragma once

#include "emulator/core/bus_config.hpp"
#include "model/setpoint.hpp"
#include "protocol/commands.hpp"
#include "protocol/wire_format.hpp"

namespace lk::emulator {

// Ranges of the registers; written values are clamped to them.
inline constexpr double kMinSpeed_dps = 1;  // the control loops need a limit above 0
inline constexpr double kMaxSpeed_dps = 72'000;
inline constexpr double kMaxAngle_deg = 1e7;
inline constexpr double kMaxCurrentRamp_A_s = 1e6;

/// Converts the registers to settings of control loops and protections: SI units, rotor side.
/// `format` gives the LSB of Max Torque Current.
model::ControlSettings control_settings(
    const Registers& registers, const protocol::WireFormat& format = protocol::kLegacyFormat);

/// Returns the parameter as in the reply to 0xC0.
protocol::Parameter get_parameter(const Registers& registers, protocol::ParameterId id,
                                  const protocol::WireFormat& format);
/// Writes a parameter as 0xC1 does. Writing the value that 0xC0 reads changes nothing.
void set_parameter(Registers& registers, const protocol::Parameter& parameter,
                   const protocol::WireFormat& format);

/// Clamps a number to a field of int16.
std::int32_t in_16_bits(std::int32_t number);

/// Returns the ROM parameter that stores the parameter `id` of 0xC0 and 0xC1.
RomParameter rom_parameter_of(protocol::ParameterId id, Series series);

/// Copies `parameter` from `from` to `to`.
void copy_parameter(RomParameter parameter, const Registers& from, Registers& to);

}  // namespace lk::emulator
