#pragma once

/// @file Fields that several commands or replies share; command_table.hpp has the others.

#include <array>
#include <type_traits>

#include "protocol/commands.hpp"
#include "protocol/field.hpp"
#include "protocol/meanings.hpp"
#include "protocol/multi_drive_commands.hpp"
#include "protocol/quantities.hpp"
#include "protocol/replies.hpp"
#include "protocol/rows.hpp"
#include "protocol/switches.hpp"

namespace lk::protocol {

/// A field and its `member`: std::invoke(member, x) is the field's value in the command or reply x.
template <class Member>
struct FieldRow {
  Member member;
  Field field;
};

namespace table {

template <class Member>
constexpr FieldRow<Member> row(Member member, Field field) {
  field.unit = find_quantity(field.key)->unit;  // an unknown key does not compile
  return {member, field};
}

// clang-format off

inline constexpr auto kGains = rows(
    row([](auto& c) -> auto& { return c.gains.angle_kp; }, {.name = "angle_kp", .label = "Kp of the angle loop", .key = "angle_kp", .byte = 2}),
    row([](auto& c) -> auto& { return c.gains.angle_ki; }, {.name = "angle_ki", .label = "Ki of the angle loop", .key = "angle_ki", .byte = 3}),
    row([](auto& c) -> auto& { return c.gains.speed_kp; }, {.name = "speed_kp", .label = "Kp of the speed loop", .key = "speed_kp", .byte = 4}),
    row([](auto& c) -> auto& { return c.gains.speed_ki; }, {.name = "speed_ki", .label = "Ki of the speed loop", .key = "speed_ki", .byte = 5}),
    row([](auto& c) -> auto& { return c.gains.iq_kp; }, {.name = "iq_kp", .label = "Kp of the current loop", .key = "iq_kp", .byte = 6}),
    row([](auto& c) -> auto& { return c.gains.iq_ki; }, {.name = "iq_ki", .label = "Ki of the current loop", .key = "iq_ki", .byte = 7}));

inline constexpr auto kAcceleration = rows(
    row([](auto& c) -> auto& { return c.acceleration_dps_s; }, {.name = "acceleration", .label = "Acceleration", .key = "acceleration_dps_s", .byte = 4, .wire = Wire::kI32, .range = Range::kNotNegative, .beyond = Beyond::kDriveClamps}));

inline constexpr auto kOffset = rows(
    row([](auto& c) -> auto& { return c.offset_counts; }, {.name = "encoder_offset", .label = "Encoder offset", .key = "offset_counts", .word = "offset", .byte = 6, .wire = Wire::kU16, .range = Range::kEncoder, .beyond = Beyond::kDriveClamps, .period = Period::kEncoder}));

/// Reply to 0x19: the new encoder offset.
inline constexpr auto kZeroWritten = rows(
    row(&ZeroWritten::offset_counts, {.name = "encoder_offset", .label = "Encoder offset", .key = "offset_counts", .word = "offset", .byte = 6, .wire = Wire::kU16, .when = kNarrowZero, .period = Period::kEncoder}),
    row(&ZeroWritten::offset_counts, {.name = "zero_offset", .label = "Encoder offset", .key = "offset_counts", .word = "offset", .byte = 4, .wire = Wire::kU32, .when = kWideZero, .period = Period::kEncoder}));

inline constexpr auto kCalibrated = rows(
    row(&Calibrated::align_value, {.name = "align_value", .label = "Align value", .key = "align_value", .byte = 1, .wire = Wire::kU32}),
    row(&Calibrated::align_ratio, {.name = "align_ratio", .label = "Align ratio", .key = "align_ratio", .byte = 5, .wire = Wire::kU16}),
    row(&Calibrated::status, {.name = "calibration", .label = "Calibration", .key = "calibration", .byte = 7, .values = kCalibrations}));

inline constexpr auto kMaxTorque = rows(
    row([](auto& c) -> auto& { return c.max_torque_lsb; }, {.name = "max_torque", .label = "Max Torque Current, on MS Max Power", .key = "max_torque_lsb", .byte = 4, .wire = Wire::kI32, .range = Range::kMaxTorque, .beyond = Beyond::kDriveClamps}));

inline constexpr auto kTarget = rows(
    row([](auto& c) -> auto& { return c.target_cdeg; }, {.name = "angle_target", .label = "Target angle", .key = "angle_deg", .byte = 4, .wire = Wire::kI32, .scale = Scale::kHundredth, .range = Range::kMaxAngle, .beyond = Beyond::kDriveClamps}));

inline constexpr auto kSingleTurnTarget = rows(
    row([](auto& c) -> auto& { return c.target_cdeg; }, {.name = "single_turn_target", .label = "Target angle, single-turn", .key = "angle_deg", .byte = 4, .wire = Wire::kU16, .scale = Scale::kHundredth, .range = Range::kCircle, .beyond = Beyond::kNotExecuted, .when = kNarrowTarget}),
    row([](auto& c) -> auto& { return c.target_cdeg; }, {.name = "single_turn_target", .label = "Target angle, single-turn", .key = "angle_deg", .byte = 4, .wire = Wire::kU32, .scale = Scale::kHundredth, .range = Range::kCircle, .beyond = Beyond::kNotExecuted, .when = kWideTarget}));

inline constexpr auto kDirection = rows(
    row([](auto& c) -> auto& { return c.direction; }, {.name = "direction", .label = "Direction", .key = "direction", .byte = 1, .range = Range::kWords, .beyond = Beyond::kNotExecuted, .values = kDirections}));

inline constexpr auto kIncrement = rows(
    row([](auto& c) -> auto& { return c.increment_cdeg; }, {.name = "increment", .label = "Increment", .key = "turn_deg", .byte = 4, .wire = Wire::kI32, .scale = Scale::kHundredth}));

inline constexpr auto kMaxSpeed = rows(
    row([](auto& c) -> auto& { return c.max_speed_dps; }, {.name = "max_speed", .label = "Max speed", .key = "max_speed_dps", .byte = 2, .wire = Wire::kU16, .is_optional_in_scenarios = true}));

inline constexpr auto kTemperature = rows(
    row([](auto& c) -> auto& { return c.temperature_C; }, {.name = "temperature", .label = "Temperature", .key = "temperature_C", .byte = 1, .wire = Wire::kI8}));

inline constexpr auto kState1 = joined(kTemperature, rows(
    row(&State1::voltage_V, {.name = "voltage", .label = "Voltage", .key = "voltage_V", .byte = 3, .wire = Wire::kU16, .scale = Scale::kVoltage, .when = kDeciVolt}),
    row(&State1::voltage_V, {.name = "voltage", .label = "Voltage", .key = "voltage_V", .byte = 2, .wire = Wire::kU16, .scale = Scale::kVoltage, .when = kCentiVolt}),
    row(&State1::errors, {.name = "errors", .label = "Errors", .key = "errors", .byte = 7, .flags = kErrors}),
    row(&State1::bus_current_A, {.name = "bus_current", .label = "Bus current", .key = "bus_current_A", .byte = 4, .wire = Wire::kI16, .scale = Scale::kCenti, .when = kBusCurrent}),
    row(&State1::bridge_on, {.name = "bridge", .label = "Bridge", .key = "bridge_on", .byte = 6, .scale = Scale::kBridge, .when = kBusCurrent, .values = kBridge})));

inline constexpr auto kState2 = joined(kTemperature, rows(
    row(&State2::iq_A, {.name = "iq", .label = "Torque current", .key = "iq_A", .byte = 2, .wire = Wire::kI16, .scale = Scale::kIqReply, .range = Range::kIqReply, .when = kNotOnMs}),
    row(&State2::power_permille, {.name = "power", .label = "Power", .key = "power_permille", .byte = 2, .wire = Wire::kI16, .range = Range::kPowerReply, .when = kOnMs}),
    row(&State2::speed_dps, {.name = "speed", .label = "Speed", .key = "speed_dps", .byte = 4, .wire = Wire::kI16}),
    row(&State2::encoder_counts, {.name = "encoder", .label = "Encoder", .key = "encoder_counts", .word = "encoder", .byte = 6, .wire = Wire::kU16, .period = Period::kEncoder})));

inline constexpr auto kState3 = joined(kTemperature, rows(
    row(&State3::i_a_A, {.name = "i_a", .label = "Current of phase a", .key = "i_a_A", .byte = 2, .wire = Wire::kI16, .scale = Scale::kPhaseCurrent}),
    row(&State3::i_b_A, {.name = "i_b", .label = "Current of phase b", .key = "i_b_A", .byte = 4, .wire = Wire::kI16, .scale = Scale::kPhaseCurrent}),
    row(&State3::i_c_A, {.name = "i_c", .label = "Current of phase c", .key = "i_c_A", .byte = 6, .wire = Wire::kI16, .scale = Scale::kPhaseCurrent})));

inline constexpr auto kEncoderReply = rows(
    row(&Encoder::encoder_counts, {.name = "encoder_position", .label = "Encoder", .key = "encoder_counts", .word = "encoder", .byte = 2, .wire = Wire::kU16, .period = Period::kEncoder}),
    row(&Encoder::raw_counts, {.name = "encoder_raw", .label = "Encoder, raw", .key = "raw_counts", .byte = 4, .wire = Wire::kU16, .period = Period::kEncoder}),
    row(&Encoder::offset_counts, {.name = "encoder_offset", .label = "Encoder offset", .key = "offset_counts", .word = "offset", .byte = 6, .wire = Wire::kU16, .period = Period::kEncoder}));

inline constexpr auto kSingleTurnReply = rows(
    row(&SingleTurnAngle::angle_cdeg, {.name = "single_turn_angle", .label = "Single-turn angle", .key = "angle_deg", .byte = 6, .wire = Wire::kU16, .scale = Scale::kHundredth, .range = Range::kTurn, .beyond = Beyond::kDriveClamps, .when = kNarrowAngle, .period = Period::kCircle}),
    row(&SingleTurnAngle::angle_cdeg, {.name = "single_turn_angle", .label = "Single-turn angle", .key = "angle_deg", .byte = 4, .wire = Wire::kU32, .scale = Scale::kHundredth, .when = kWideAngle, .period = Period::kCircle}));

constexpr int number(ParameterId id) { return static_cast<int>(id); }
inline constexpr auto kKp = [](auto& c) -> auto& { return c.parameter.gains.kp; };
inline constexpr auto kKi = [](auto& c) -> auto& { return c.parameter.gains.ki; };
inline constexpr auto kKd = [](auto& c) -> auto& { return c.parameter.gains.kd; };
inline constexpr auto kNumber = [](auto& c) -> auto& { return c.parameter.number; };
inline constexpr auto kParameter = rows(
    row([](auto& c) -> auto& { return c.parameter.id; }, {.name = "parameter", .label = "Parameter", .key = "parameter", .byte = 1, .range = Range::kWords, .beyond = Beyond::kUnknownCommand, .values = kParameters}),
    row(kKp, {.name = "angle_kp", .label = "Kp of the angle loop", .key = "kp", .byte = 2, .wire = Wire::kU16, .parameter = number(ParameterId::kAngleGains)}),
    row(kKi, {.name = "angle_ki", .label = "Ki of the angle loop", .key = "ki", .byte = 4, .wire = Wire::kU16, .parameter = number(ParameterId::kAngleGains)}),
    row(kKd, {.name = "angle_kd", .label = "Kd of the angle loop", .key = "kd", .byte = 6, .wire = Wire::kU16, .parameter = number(ParameterId::kAngleGains)}),
    row(kKp, {.name = "speed_kp", .label = "Kp of the speed loop", .key = "kp", .byte = 2, .wire = Wire::kU16, .parameter = number(ParameterId::kSpeedGains)}),
    row(kKi, {.name = "speed_ki", .label = "Ki of the speed loop", .key = "ki", .byte = 4, .wire = Wire::kU16, .parameter = number(ParameterId::kSpeedGains)}),
    row(kKd, {.name = "speed_kd", .label = "Kd of the speed loop", .key = "kd", .byte = 6, .wire = Wire::kU16, .parameter = number(ParameterId::kSpeedGains)}),
    row(kKp, {.name = "iq_kp", .label = "Kp of the current loop", .key = "kp", .byte = 2, .wire = Wire::kU16, .parameter = number(ParameterId::kCurrentGains)}),
    row(kKi, {.name = "iq_ki", .label = "Ki of the current loop", .key = "ki", .byte = 4, .wire = Wire::kU16, .parameter = number(ParameterId::kCurrentGains)}),
    row(kKd, {.name = "iq_kd", .label = "Kd of the current loop", .key = "kd", .byte = 6, .wire = Wire::kU16, .parameter = number(ParameterId::kCurrentGains)}),
    row(kNumber, {.name = "register_max_torque_current", .label = "Max Torque Current", .key = "max_current_A", .byte = 4, .wire = Wire::kI16, .scale = Scale::kIqCommand, .range = Range::kMaxCurrent, .beyond = Beyond::kDriveClamps, .when = kNotOnMs, .parameter = number(ParameterId::kMaxTorqueCurrent)}),
    row(kNumber, {.name = "register_max_power", .label = "Max Power", .key = "max_power_permille", .byte = 4, .wire = Wire::kI16, .range = Range::kMaxCurrent, .beyond = Beyond::kDriveClamps, .when = kOnMs, .parameter = number(ParameterId::kMaxTorqueCurrent)}),
    row(kNumber, {.name = "register_max_speed", .label = "Max Speed", .key = "max_speed_dps", .byte = 4, .wire = Wire::kI32, .scale = Scale::kHundredth, .range = Range::kSpeedSetting, .beyond = Beyond::kDriveClamps, .parameter = number(ParameterId::kMaxSpeed)}),
    row(kNumber, {.name = "register_max_angle", .label = "Max Angle", .key = "max_angle_deg", .byte = 4, .wire = Wire::kI32, .scale = Scale::kHundredth, .range = Range::kAngleSetting, .beyond = Beyond::kDriveClamps, .parameter = number(ParameterId::kMaxAngle)}),
    row(kNumber, {.name = "register_current_ramp", .label = "Current ramp", .key = "current_ramp_A_s", .byte = 4, .wire = Wire::kI32, .scale = Scale::kThousandth, .range = Range::kCurrentRamp, .beyond = Beyond::kDriveClamps, .parameter = number(ParameterId::kCurrentRamp)}),
    row(kNumber, {.name = "register_speed_ramp", .label = "Speed ramp", .key = "acceleration_dps_s", .byte = 4, .wire = Wire::kI32, .range = Range::kNotNegative, .beyond = Beyond::kDriveClamps, .parameter = number(ParameterId::kSpeedRamp)}));

inline constexpr auto kStoredSettingId = rows(
    row([](auto& c) -> auto& { return c.setting.table; }, {.name = "setting", .label = "Setting", .key = "parameter", .byte = 1, .range = Range::kWords, .beyond = Beyond::kUnknownCommand, .values = kSettingTables}),
    row([](auto& c) -> auto& { return c.setting.item; }, {.name = "setting_item", .label = "Setting, its number", .key = "item", .byte = 2, .range = Range::kWords, .beyond = Beyond::kUnknownCommand, .parameter = kNamedSettings, .values = kSettingItems}));

/// Fields of a read query. Their names differ from those in kStoredSettingId, because no other
/// field of a read query depends on them.
inline constexpr auto kReadStoredSetting = rows(
    row([](auto& c) -> auto& { return c.setting.table; }, {.name = "read_setting", .label = "Setting", .key = "parameter", .byte = 1, .range = Range::kWords, .beyond = Beyond::kUnknownCommand, .values = kSettingTables}),
    row([](auto& c) -> auto& { return c.setting.item; }, {.name = "read_setting_item", .label = "Setting, its number", .key = "item", .byte = 2, .range = Range::kWords, .beyond = Beyond::kUnknownCommand, .parameter = kNamedSettings, .values = kSettingItems}));

/// Completes the field of a setting that DATA[2] selects.
constexpr Field stored(StoredSettingId id, Field field) {
  field.byte = 4;
  field.beyond = Beyond::kNotExecuted;
  field.parameter = kNamedSettings;
  field.item = static_cast<int>(id) >> 8;
  if (field.range == Range::kWidth) field.range = Range::kBetween;
  return field;
}
/// Completes the field of a Kp, Ki or Kd.
constexpr Field stored_gain(StoredSettingId id, Field field) {
  field.wire = Wire::kU16, field.range = Range::kBetween, field.max = kMaxGain;
  field.beyond = Beyond::kNotExecuted;
  field.parameter = static_cast<int>(id);
  return field;
}
inline constexpr auto kStoredKp = [](auto& c) -> auto& { return c.setting.gains.kp; };
inline constexpr auto kStoredKi = [](auto& c) -> auto& { return c.setting.gains.ki; };
inline constexpr auto kStoredKd = [](auto& c) -> auto& { return c.setting.gains.kd; };
inline constexpr auto kStoredNumber = [](auto& c) -> auto& { return c.setting.number; };
inline constexpr auto kStoredSetting = joined(kStoredSettingId, rows(
    row(kStoredKp, stored_gain(StoredSettingId::kAngleGains, {.name = "setting_angle_kp", .label = "Kp of the angle loop", .key = "kp", .byte = 2})),
    row(kStoredKi, stored_gain(StoredSettingId::kAngleGains, {.name = "setting_angle_ki", .label = "Ki of the angle loop", .key = "ki", .byte = 4})),
    row(kStoredKd, stored_gain(StoredSettingId::kAngleGains, {.name = "setting_angle_kd", .label = "Kd of the angle loop", .key = "kd", .byte = 6})),
    row(kStoredKp, stored_gain(StoredSettingId::kSpeedGains, {.name = "setting_speed_kp", .label = "Kp of the speed loop", .key = "kp", .byte = 2})),
    row(kStoredKi, stored_gain(StoredSettingId::kSpeedGains, {.name = "setting_speed_ki", .label = "Ki of the speed loop", .key = "ki", .byte = 4})),
    row(kStoredKd, stored_gain(StoredSettingId::kSpeedGains, {.name = "setting_speed_kd", .label = "Kd of the speed loop", .key = "kd", .byte = 6})),
    row(kStoredKp, stored_gain(StoredSettingId::kCurrentGains, {.name = "setting_iq_kp", .label = "Kp of the current loop", .key = "kp", .byte = 2})),
    row(kStoredKi, stored_gain(StoredSettingId::kCurrentGains, {.name = "setting_iq_ki", .label = "Ki of the current loop", .key = "ki", .byte = 4})),
    row(kStoredKd, stored_gain(StoredSettingId::kCurrentGains, {.name = "setting_iq_kd", .label = "Kd of the current loop", .key = "kd", .byte = 6})),
    row(kStoredNumber, stored(StoredSettingId::kDriverId, {.name = "setting_driver_id", .label = "Driver ID, 0: the DIP switch's", .key = "driver_id", .max = kMaxId})),
    row(kStoredNumber, stored(StoredSettingId::kBusType, {.name = "setting_bus_type", .label = "Bus type", .key = "bus_type", .range = Range::kWords, .values = kBusTypes})),
    row(kStoredNumber, stored(StoredSettingId::kSerialRate, {.name = "setting_rs485_rate", .label = "Bit rate on RS-485", .key = "rs485_rate", .range = Range::kWords, .values = kSerialRates})),
    row(kStoredNumber, stored(StoredSettingId::kCanRate, {.name = "setting_can_rate", .label = "Bit rate on CAN", .key = "can_rate", .range = Range::kWords, .values = kCanRates})),
    row(kStoredNumber, stored(StoredSettingId::kMaxTorqueCurrent, {.name = "setting_max_torque_current", .label = "Max Torque Current", .key = "max_current_A", .wire = Wire::kI16, .scale = Scale::kIqCommand, .when = kNotOnMs, .max = kMaxTorque_lsb})),
    row(kStoredNumber, stored(StoredSettingId::kMaxTorqueCurrent, {.name = "setting_max_power", .label = "Max Power", .key = "max_power_permille", .wire = Wire::kI16, .when = kOnMs, .max = kMaxPower_permille})),
    row(kStoredNumber, stored(StoredSettingId::kMaxSpeed, {.name = "setting_max_speed", .label = "Max Speed", .key = "max_speed_dps", .wire = Wire::kI32, .scale = Scale::kHundredth, .max = kMaxSpeed_cdps})),
    row(kStoredNumber, stored(StoredSettingId::kMaxAngle, {.name = "setting_max_angle", .label = "Max Angle", .key = "max_angle_deg", .wire = Wire::kI32, .scale = Scale::kHundredth, .max = INT32_MAX})),
    row(kStoredNumber, stored(StoredSettingId::kCurrentRamp, {.name = "setting_current_ramp", .label = "Current ramp", .key = "current_ramp_A_s", .wire = Wire::kI16, .scale = Scale::kThousandth, .max = kMaxCurrentRamp_mA_s})),
    row(kStoredNumber, stored(StoredSettingId::kSpeedRamp, {.name = "setting_speed_ramp", .label = "Speed ramp", .key = "acceleration_dps_s", .wire = Wire::kI32, .max = kMaxSpeedRamp_dps_s}))));
inline constexpr auto kSave = rows(
    row(&SaveSettings::table, {.name = "save", .label = "What is saved", .key = "parameter", .byte = 1, .range = Range::kWords, .beyond = Beyond::kUnknownCommand, .is_optional_in_scenarios = true, .values = kSaveTable}),
    row(&SaveSettings::item, {.name = "save_item", .label = "That it is saved", .key = "item", .byte = 2, .range = Range::kWords, .beyond = Beyond::kUnknownCommand, .is_optional_in_scenarios = true, .values = kSaveItems}));
inline constexpr auto kSavedReply = rows(
    row(&SettingsSaved::table, {.name = "save", .label = "What is saved", .key = "parameter", .byte = 1, .values = kSaveTable}),
    row(&SettingsSaved::saved, {.name = "saved", .label = "Saved", .key = "saved", .byte = 2, .scale = Scale::kFlag, .values = kSaved}));

/// Returns a row for each of the drives 1..4. Pre: `member` is an array with their values.
template <class Member>
constexpr auto slots(Member member, Field field, const std::array<std::string_view, kMultiDriveSlots>& names) {
  constexpr std::array<std::string_view, kMultiDriveSlots> kLabels = {"Drive 1", "Drive 2", "Drive 3", "Drive 4"};
  constexpr std::array<std::string_view, kMultiDriveSlots> kKeys = {"1", "2", "3", "4"};
  const auto slot = [&]<std::size_t N>(std::integral_constant<std::size_t, N>) {
    field.name = names[N], field.label = kLabels[N], field.key = kKeys[N], field.byte = 2 * N;
    const auto slot_member = [member](auto& c) -> auto& { return std::get<N>(c.*member); };
    return FieldRow<std::remove_const_t<decltype(slot_member)>>{slot_member, field};
  };
  return rows(slot(std::integral_constant<std::size_t, 0>{}), slot(std::integral_constant<std::size_t, 1>{}),
                    slot(std::integral_constant<std::size_t, 2>{}), slot(std::integral_constant<std::size_t, 3>{}));
}
// clang-format on

}  // namespace table
}  // namespace lk::protocol
