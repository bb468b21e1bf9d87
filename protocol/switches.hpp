#pragma once

/// @file Conditions under which drives have a command or field. The texts name the quirks that
/// docs/reference/configuration.md describes.

#include "protocol/field.hpp"

namespace lk::protocol::table {

template <bool Dialect::*kSwitch>
constexpr bool is_on(const WireFormat& format) {
  return format.dialect.*kSwitch;
}
template <bool Dialect::*kSwitch>
constexpr bool is_off(const WireFormat& format) {
  return !is_on<kSwitch>(format);
}

inline constexpr When kPidCommands{"pid_commands = true", is_on<&Dialect::pid_commands>};
inline constexpr When kOffsetCommand{"offset_command = true", is_on<&Dialect::offset_command>};
inline constexpr When kBrakeCommand{"brake_command = true", is_on<&Dialect::brake_command>};
inline constexpr When kOpenLoopCommand{"open_loop_command = true",
                                       is_on<&Dialect::open_loop_command>};
inline constexpr When kParameterCommands{"parameter_commands = true",
                                         is_on<&Dialect::parameter_commands>};
inline constexpr When kMultiDriveMore{"multi_drive_more = true", is_on<&Dialect::multi_drive_more>};
inline constexpr When kMaxTorqueCommands{"max_torque_commands = true",
                                         is_on<&Dialect::max_torque_commands>};
inline constexpr When kSettingCommands{"setting_commands = true",
                                       is_on<&Dialect::setting_commands>};
inline constexpr When kRestartCommand{"restart_command = true", is_on<&Dialect::restart_command>};
inline constexpr When kCalibrateCommand{"calibrate_command = true",
                                        is_on<&Dialect::calibrate_command>};
inline constexpr When kNarrowZero{"zero_reply_bits = 16", is_off<&Dialect::wide_zero_reply>};
inline constexpr When kWideZero{"zero_reply_bits = 32", is_on<&Dialect::wide_zero_reply>};
inline constexpr When kSetsAngle{"clear_angle = \"sets_angle\"", [](const WireFormat& f) {
                                   return f.dialect.clear_angle == ClearAngleMeaning::kSetsAngle;
                                 }};
inline constexpr When kSpeedIqLimit{"speed_iq_limit = true, not on MS", [](const WireFormat& f) {
                                      return f.dialect.speed_iq_limit && f.series != Series::kMs;
                                    }};
inline constexpr When kNarrowTarget{"single_turn_target_bits = 16",
                                    is_off<&Dialect::wide_single_turn_target>};
inline constexpr When kWideTarget{"single_turn_target_bits = 32",
                                  is_on<&Dialect::wide_single_turn_target>};
inline constexpr When kNarrowAngle{"single_turn_bits = 16", is_off<&Dialect::wide_single_turn>};
inline constexpr When kWideAngle{"single_turn_bits = 32", is_on<&Dialect::wide_single_turn>};
inline constexpr When kDeciVolt{"state_1 = \"decivolt\"", [](const WireFormat& f) {
                                  return f.dialect.state_1 == State1Layout::kDeciVolt;
                                }};
inline constexpr When kCentiVolt{
    "state_1 = \"centivolt\" or with bus current",
    [](const WireFormat& f) { return f.dialect.state_1 != State1Layout::kDeciVolt; }};
inline constexpr When kBusCurrent{
    "state_1 = \"centivolt_and_bus_current\"",
    [](const WireFormat& f) { return f.dialect.state_1 == State1Layout::kCentiVoltAndBusCurrent; }};
// For RS-485 only.
inline constexpr When kClearTurnsCommand{"clear_turns_command = true",
                                         is_on<&Dialect::clear_turns_command>};
inline constexpr When kZeroRamCommand{"zero_ram_command = true", is_on<&Dialect::zero_ram_command>};
inline constexpr When kZeroRamAngle{
    "zero_ram_len = 7", [](const WireFormat& f) { return f.dialect.zero_ram_len == 7; }};
inline constexpr When kPlainEncoder{"typed_encoder = false", is_off<&Dialect::typed_encoder>};
inline constexpr When kTypedEncoder{"typed_encoder = true", is_on<&Dialect::typed_encoder>};
inline constexpr When kProductInfo{"product_info_bytes above 0", [](const WireFormat& f) {
                                     return f.dialect.product_info_bytes > 0;
                                   }};
inline constexpr When kToolCommands{"tool_commands = true", is_on<&Dialect::tool_commands>};
inline constexpr When kRestoreCommand{"restore_command = true", is_on<&Dialect::restore_command>};
inline constexpr When kOnMs{"MS", [](const WireFormat& f) { return f.series == Series::kMs; }};
inline constexpr When kNotOnMs{"not MS",
                               [](const WireFormat& f) { return f.series != Series::kMs; }};

}  // namespace lk::protocol::table
