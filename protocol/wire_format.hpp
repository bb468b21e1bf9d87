#pragma once

#include <cstdint>

namespace lk::protocol {

/// The scales that differ between generations and series of drives: how much one LSB is. Everything
/// else on the wire (0.01°, 0.01 dps, 1 dps, 1 dps/s, 1 °C) has one scale for all of them.
struct WireFormat {
  double iq_command_lsb_A;            // 0xA1, 0x280
  std::int16_t iq_command_limit_lsb;  // commands beyond are clamped
  double iq_reply_lsb_A;              // state 2
  std::int16_t iq_reply_limit_lsb;
  double phase_current_lsb_A;  // state 3
  double voltage_lsb_V;        // state 1
};

/// The manual's drive: ±2000 is ±32 A in commands, ±2048 is ±33 A in replies.
inline constexpr WireFormat kLegacyFormat{
    .iq_command_lsb_A = 32.0 / 2000.0,
    .iq_command_limit_lsb = 2000,
    .iq_reply_lsb_A = 33.0 / 2048.0,
    .iq_reply_limit_lsb = 2048,
    .phase_current_lsb_A = 1.0 / 64.0,
    .voltage_lsb_V = 0.1,
};

}  // namespace lk::protocol
