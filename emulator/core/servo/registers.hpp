#pragma once

#include "emulator/core/bus_config.hpp"
#include "model/setpoint.hpp"
#include "protocol/commands.hpp"
#include "protocol/wire_format.hpp"

namespace lk::emulator {

// What the registers can hold; what is written beyond is clamped.
inline constexpr double kMinSpeed_dps = 1;  // the loops want a limit above 0
inline constexpr double kMaxSpeed_dps = 72'000;
inline constexpr double kMaxAngle_deg = 1e7;
inline constexpr double kMaxCurrentRamp_A_s = 1e6;

/// The registers as the loops and the protections read them: SI, rotor side. `format` says how much
/// one LSB of Max Torque Current is.
model::ControlSettings control_settings(
    const Registers& registers, const protocol::WireFormat& format = protocol::kLegacyFormat);

/// What 0xC0 answers.
protocol::Parameter get_parameter(const Registers& registers, protocol::ParameterId id,
                                  const protocol::WireFormat& format);
/// Writes a parameter as 0xC1 does. Writing the value that 0xC0 reads changes nothing.
void set_parameter(Registers& registers, const protocol::Parameter& parameter,
                   const protocol::WireFormat& format);

/// A number as a field of int16 shows it.
std::int32_t in_16_bits(std::int32_t number);

/// Where ROM keeps what 0xC1 writes to RAM.
RomParameter rom_parameter_of(protocol::ParameterId id, Series series);

/// `parameter` of `to` becomes what it is in `from`.
void copy_parameter(RomParameter parameter, const Registers& from, Registers& to);

}  // namespace lk::emulator
