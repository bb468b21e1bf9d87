#pragma once

/// @file Commands on RS-485: the rows of command_table.hpp with the byte positions of RS-485, and
/// commands that CAN does not have. DATA[0] is CMD, DATA[1 + n] is D[n] (docs/reference/rs485.md).

#include <cstdint>
#include <type_traits>

#include "protocol/command_table.hpp"
#include "protocol/serial_commands.hpp"

namespace lk::protocol {
namespace table {

/// Returns the fields, moved by `by` bytes.
template <class Places, class... Rows>
constexpr auto moved(RowList<Places, Rows...> fields, int by) {
  [&]<std::size_t... N>(std::index_sequence<N...>) {
    ((static_cast<RowLeaf<N, Rows>&>(fields).value.field.byte =
          static_cast<std::uint8_t>(at<N>(fields).field.byte + by)),
     ...);
  }
  (std::index_sequence_for<Rows...>{});
  return fields;
}

/// Returns the fields for a packet that ends with DATA[`end` - 1] and has zeros in unused bytes.
template <class Places, class... Rows>
constexpr auto filled(RowList<Places, Rows...> fields, std::uint8_t end) {
  static_cast<RowLeaf<0, std::remove_cvref_t<decltype(at<0>(fields))>>&>(fields).value.field.end =
      end;
  return fields;
}

/// Returns the row of the command in the table of CAN.
template <class Query>
constexpr const auto& can_row() {
  return at<row_codec::query_place<kCommandRows, Query>()>(kCommandRows);
}

/// Returns the row of CAN with its fields moved by `query_by` and `reply_by` bytes.
template <class Query>
constexpr auto as_on_can(int query_by = 0, int reply_by = 0) {
  const auto& row = can_row<Query>();
  using Reply = typename std::remove_cvref_t<decltype(row)>::ReplyType;
  return command<Query, Reply>(row.traits, moved(row.query, query_by), moved(row.reply, reply_by));
}

/// Returns the row of CAN with `fields` as the fields of the query.
template <class Query, class QueryFields>
constexpr auto with_query(QueryFields fields) {
  const auto& row = can_row<Query>();
  using Reply = typename std::remove_cvref_t<decltype(row)>::ReplyType;
  return command<Query, Reply>(row.traits, fields, row.reply);
}

template <class Query>
constexpr CommandTraits traits_with(WrongLength wrong_length) {
  CommandTraits traits = can_row<Query>().traits;
  traits.wrong_length = wrong_length;
  return traits;
}

// clang-format off

inline constexpr Value kEncoderTypes[] = {{kEncoderZeroed, "encoder"}, {kEncoderRaw, "raw"}};
inline constexpr Value kDeviceTypes[] = {{0x2011, "MS"}, {0x2021, "MF"}, {0x2031, "MG"}, {0x2032, "MG with reducer encoder"}, {0x2041, "MH"}};
inline constexpr Value kDone[] = {{0, "done"}, {1, "refused"}};
inline constexpr Value kSettings[] = {
    {static_cast<unsigned>(SettingId::kAngleGains), "gains of the angle loop"},
    {static_cast<unsigned>(SettingId::kSpeedGains), "gains of the speed loop"},
    {static_cast<unsigned>(SettingId::kCurrentGains), "gains of the current loop"},
    {static_cast<unsigned>(SettingId::kMaxTorqueCurrent), "Max Torque Current, on MS Max Power"},
    {static_cast<unsigned>(SettingId::kMaxSpeed), "Max Speed"},
    {static_cast<unsigned>(SettingId::kMaxAngleLow), "Max Angle, low half"},
    {static_cast<unsigned>(SettingId::kMaxAngleHigh), "Max Angle, high half"},
    {static_cast<unsigned>(SettingId::kCurrentRamp), "current ramp"},
    {static_cast<unsigned>(SettingId::kSpeedRamp), "speed ramp"}};

constexpr int number(SettingId id) { return static_cast<int>(id); }
inline constexpr auto kSettingKp = [](auto& c) -> auto& { return c.setting.gains.kp; };
inline constexpr auto kSettingKi = [](auto& c) -> auto& { return c.setting.gains.ki; };
inline constexpr auto kSettingKd = [](auto& c) -> auto& { return c.setting.gains.kd; };
inline constexpr auto kSettingNumber = [](auto& c) -> auto& { return c.setting.number; };
inline constexpr auto kSettingValue = rows(
    row(kSettingKp, {.name = "setting_angle_kp", .label = "Kp of the angle loop", .key = "kp", .byte = 2, .wire = Wire::kU16, .parameter = number(SettingId::kAngleGains)}),
    row(kSettingKi, {.name = "setting_angle_ki", .label = "Ki of the angle loop", .key = "ki", .byte = 4, .wire = Wire::kU16, .parameter = number(SettingId::kAngleGains)}),
    row(kSettingKd, {.name = "setting_angle_kd", .label = "Kd of the angle loop", .key = "kd", .byte = 6, .wire = Wire::kU16, .parameter = number(SettingId::kAngleGains)}),
    row(kSettingKp, {.name = "setting_speed_kp", .label = "Kp of the speed loop", .key = "kp", .byte = 2, .wire = Wire::kU16, .parameter = number(SettingId::kSpeedGains)}),
    row(kSettingKi, {.name = "setting_speed_ki", .label = "Ki of the speed loop", .key = "ki", .byte = 4, .wire = Wire::kU16, .parameter = number(SettingId::kSpeedGains)}),
    row(kSettingKd, {.name = "setting_speed_kd", .label = "Kd of the speed loop", .key = "kd", .byte = 6, .wire = Wire::kU16, .parameter = number(SettingId::kSpeedGains)}),
    row(kSettingKp, {.name = "setting_iq_kp", .label = "Kp of the current loop", .key = "kp", .byte = 2, .wire = Wire::kU16, .parameter = number(SettingId::kCurrentGains)}),
    row(kSettingKi, {.name = "setting_iq_ki", .label = "Ki of the current loop", .key = "ki", .byte = 4, .wire = Wire::kU16, .parameter = number(SettingId::kCurrentGains)}),
    row(kSettingKd, {.name = "setting_iq_kd", .label = "Kd of the current loop", .key = "kd", .byte = 6, .wire = Wire::kU16, .parameter = number(SettingId::kCurrentGains)}),
    row(kSettingNumber, {.name = "setting_max_torque_current", .label = "Max Torque Current", .key = "max_current_A", .byte = 2, .wire = Wire::kI16, .scale = Scale::kIqCommand, .range = Range::kMaxCurrent, .beyond = Beyond::kDriveClamps, .when = kNotOnMs, .parameter = number(SettingId::kMaxTorqueCurrent)}),
    row(kSettingNumber, {.name = "setting_max_power", .label = "Max Power", .key = "max_power_permille", .byte = 2, .wire = Wire::kI16, .range = Range::kMaxCurrent, .beyond = Beyond::kDriveClamps, .when = kOnMs, .parameter = number(SettingId::kMaxTorqueCurrent)}),
    row(kSettingNumber, {.name = "setting_max_speed", .label = "Max Speed", .key = "max_speed_dps", .byte = 2, .wire = Wire::kI32, .scale = Scale::kHundredth, .range = Range::kSpeedSetting, .beyond = Beyond::kDriveClamps, .parameter = number(SettingId::kMaxSpeed)}),
    row(kSettingNumber, {.name = "setting_max_angle_low", .label = "Max Angle, low half", .key = "max_angle_low_deg", .byte = 2, .wire = Wire::kI32, .scale = Scale::kHundredth, .parameter = number(SettingId::kMaxAngleLow)}),
    row(kSettingNumber, {.name = "setting_max_angle_high", .label = "Max Angle, high half", .key = "max_angle_high", .byte = 2, .wire = Wire::kI32, .parameter = number(SettingId::kMaxAngleHigh)}),
    row(kSettingNumber, {.name = "setting_current_ramp", .label = "Current ramp", .key = "current_ramp_A_s", .byte = 2, .wire = Wire::kI16, .scale = Scale::kThousandth, .range = Range::kCurrentRamp, .beyond = Beyond::kDriveClamps, .parameter = number(SettingId::kCurrentRamp)}),
    row(kSettingNumber, {.name = "setting_speed_ramp", .label = "Speed ramp", .key = "acceleration_dps_s", .byte = 2, .wire = Wire::kI32, .range = Range::kNotNegative, .beyond = Beyond::kDriveClamps, .parameter = number(SettingId::kSpeedRamp)}));
inline constexpr auto kSettingId = rows(
    row([](auto& c) -> auto& { return c.setting.id; }, {.name = "setting", .label = "Setting", .key = "parameter", .byte = 1, .range = Range::kWords, .beyond = Beyond::kDriveClamps, .values = kSettings}));
inline constexpr auto kSetting = filled(joined(kSettingId, kSettingValue), 8);
inline constexpr auto kSettingWritten = rows(
    row(&SettingWritten::id, {.name = "setting", .label = "Setting", .key = "parameter", .byte = 1, .range = Range::kWords, .values = kSettings}),
    row(&SettingWritten::refused, {.name = "refused", .label = "Refused", .key = "refused", .byte = 2, .scale = Scale::kFlag, .values = kDone}));

inline constexpr auto kSerialTarget = rows(
    row([](auto& c) -> auto& { return c.target_cdeg; }, {.name = "angle_target", .label = "Target angle", .key = "angle_deg", .byte = 1, .wire = Wire::kI64, .scale = Scale::kHundredth, .range = Range::kMaxAngle, .beyond = Beyond::kDriveClamps}));
inline constexpr auto kSerialSingleTurnTarget = rows(
    row([](auto& c) -> auto& { return c.target_cdeg; }, {.name = "single_turn_target", .label = "Target angle, single-turn", .key = "angle_deg", .byte = 2, .wire = Wire::kU16, .scale = Scale::kHundredth, .range = Range::kCircle, .beyond = Beyond::kNotExecuted, .when = kNarrowTarget, .end = 5}),
    row([](auto& c) -> auto& { return c.target_cdeg; }, {.name = "single_turn_target", .label = "Target angle, single-turn", .key = "angle_deg", .byte = 2, .wire = Wire::kU24, .scale = Scale::kHundredth, .range = Range::kCircle, .beyond = Beyond::kNotExecuted, .when = kWideTarget}));
inline constexpr auto kSerialMaxSpeed = rows(
    row([](auto& c) -> auto& { return c.max_speed_dps; }, {.name = "max_speed", .label = "Max speed", .key = "max_speed_dps", .byte = 1, .wire = Wire::kU32, .scale = Scale::kCenti, .is_optional_in_scenarios = true}));

inline constexpr Value kEncoders[] = {{0, "motor"}, {1, "reducer"}};
inline constexpr auto kSerialZeroWritten = rows(
    row(&ZeroWritten::offset_counts, {.name = "zero_offset", .label = "Encoder offset", .key = "offset_counts", .word = "offset", .byte = 1, .wire = Wire::kU16, .when = kNarrowZero, .period = Period::kEncoder}),
    row(&ZeroWritten::encoder, {.name = "zeroed_encoder", .label = "Encoder", .key = "encoder_type", .byte = 3, .when = kWideZero, .values = kEncoders}),
    row(&ZeroWritten::offset_counts, {.name = "zero_offset", .label = "Encoder offset", .key = "offset_counts", .word = "offset", .byte = 4, .wire = Wire::kU32, .when = kWideZero, .period = Period::kEncoder}));

inline constexpr auto kSerialEncoder = rows(
    row(&Encoder::encoder_counts, {.name = "encoder_position", .label = "Encoder", .key = "encoder_counts", .word = "encoder", .byte = 1, .wire = Wire::kU16, .when = kPlainEncoder, .period = Period::kEncoder}),
    row(&Encoder::raw_counts, {.name = "encoder_raw", .label = "Encoder, raw", .key = "raw_counts", .byte = 3, .wire = Wire::kU16, .when = kPlainEncoder, .period = Period::kEncoder}),
    row(&Encoder::offset_counts, {.name = "encoder_offset", .label = "Encoder offset", .key = "offset_counts", .word = "offset", .byte = 5, .wire = Wire::kU16, .when = kPlainEncoder, .period = Period::kEncoder}),
    row(&Encoder::type, {.name = "encoder_type", .label = "Kind of position", .key = "encoder_type", .byte = 1, .when = kTypedEncoder, .values = kEncoderTypes}),
    row(&Encoder::full_counts, {.name = "encoder_full", .label = "Encoder, in full", .key = "encoder_counts", .word = "encoder", .byte = 4, .wire = Wire::kU32, .when = kTypedEncoder}));

}  // namespace table

/// Single-drive commands on RS-485, sorted by DATA[0].
inline constexpr auto kSerialRows = [] {
  using namespace table;
  return rows(
    as_on_can<Restart>(),
    command<Connect, Block>({.name = "connect", .name_zh = "连接", .word = "connect", .source = Source::kTool, .when = kToolCommands}, kNoFields, kNoFields),
    command<Disconnect, Block>({.name = "disconnect", .name_zh = "断开", .word = "disconnect", .source = Source::kTool, .when = kToolCommands}, kNoFields, kNoFields),
    command<ReadProduct, Block>({.name = "read product info", .name_zh = "读取产品信息", .word = "product", .when = kProductInfo}, kNoFields, kNoFields),
    command<ReadSettingsBlock, Block>({.name = "read settings block", .name_zh = "读取设置块", .word = "settings_block", .source = Source::kTool, .when = kToolCommands}, kNoFields, kNoFields),
    command<WriteSettingsBlock, Block>({.name = "write settings block to RAM", .name_zh = "写入设置块到 RAM", .word = "write_settings_block", .source = Source::kTool, .when = kToolCommands, .query_len = [](const WireFormat&) { return kSettingsBytes; }}, kNoFields, kNoFields),
    command<ReadCalibration, Block>({.name = "read calibration", .name_zh = "读取校准块", .word = "calibration", .source = Source::kTool, .when = kToolCommands}, kNoFields, kNoFields),
    command<WriteCalibration, Block>({.name = "write calibration", .name_zh = "写入校准块", .word = "write_calibration", .source = Source::kTool, .when = kToolCommands, .query_len = [](const WireFormat& f) { return f.series == Series::kMg ? kGearedCalibrationBytes : kCalibrationBytes; }}, kNoFields, kNoFields),
    as_on_can<Calibrate>(),
    command<WriteZeroToRom, ZeroWritten>(can_row<WriteZeroToRom>().traits, kNoFields, kSerialZeroWritten),
    command<ReadDeviceType, DeviceType>({.name = "read device type", .name_zh = "读取设备类型", .word = "device_type", .source = Source::kTool, .when = kToolCommands}, kNoFields,
      rows(row(&DeviceType::type, {.name = "device_type", .label = "Device type", .key = "device_type", .byte = 1, .wire = Wire::kU16, .values = kDeviceTypes}))),
    command<AlignReducer, Block>({.name = "align reducer encoder", .name_zh = "对齐减速端编码器", .word = "align_reducer", .source = Source::kTool, .when = kToolCommands}, kNoFields, kNoFields),
    command<ReadPid, Pid>(traits_with<ReadPid>(WrongLength::kAnswered), kNoFields, moved(kGains, -1)),
    as_on_can<WritePidToRam>(-1),
    as_on_can<WritePidToRom>(-1),
    command<ReadAcceleration, Acceleration>(traits_with<ReadAcceleration>(WrongLength::kAnswered), kNoFields, moved(kAcceleration, -3)),
    as_on_can<WriteAccelerationToRam>(-3),
    as_on_can<ReadMaxTorque>(0, -3),
    as_on_can<WriteMaxTorque>(-3),
    command<ReadSetting, SettingValue>({.name = "read setting", .name_zh = "读取设置", .word = "read_setting", .when = kSettingCommands},
      rows(row(&ReadSetting::id, {.name = "read_setting", .label = "Setting", .key = "parameter", .byte = 1, .range = Range::kWords, .beyond = Beyond::kUnknownCommand, .end = 3, .values = kSettings})), kSetting),
    command<WriteSettingToRam, SettingWritten>({.name = "write setting to RAM", .name_zh = "写入设置到 RAM", .word = "write_setting", .when = kSettingCommands}, kSetting, kSettingWritten),
    command<WriteSettingToRom, SettingWritten>({.name = "write setting to ROM", .name_zh = "写入设置到 ROM", .word = "write_setting_to_rom", .when = kSettingCommands, .writes_rom = true}, kSetting, kSettingWritten),
    command<RestoreSettings, Block>({.name = "restore settings", .name_zh = "恢复出厂设置", .word = "restore_settings", .source = Source::kTool, .when = kToolCommands}, kNoFields, kNoFields),
    command<RestoreCalibration, Block>({.name = "restore calibration", .name_zh = "恢复出厂校准", .word = "restore_calibration", .source = Source::kTool, .when = kToolCommands}, kNoFields, kNoFields),
    as_on_can<Off>(),
    as_on_can<Stop>(),
    as_on_can<Run>(),
    command<Restore, Block>({.name = "restore", .name_zh = "恢复", .word = "restore", .source = Source::kTool, .when = kRestoreCommand}, kNoFields, kNoFields),
    as_on_can<Brake>(),
    command<ReadEncoder, Encoder>(can_row<ReadEncoder>().traits,
      rows(row(&ReadEncoder::type, {.name = "read_encoder_type", .label = "Kind of position", .key = "encoder_type", .byte = 1, .range = Range::kWords, .beyond = Beyond::kUnknownCommand, .when = kTypedEncoder, .is_optional_in_scenarios = true, .end = 8, .values = kEncoderTypes})), kSerialEncoder),
    as_on_can<WriteOffsetToRom>(-5),
    command<ReadMultiTurnAngle, MultiTurnAngle>(can_row<ReadMultiTurnAngle>().traits, kNoFields,
      rows(row(&MultiTurnAngle::angle_cdeg, {.name = "multi_turn_angle", .label = "Multi-turn angle", .key = "angle_deg", .byte = 1, .wire = Wire::kI64, .scale = Scale::kHundredth}))),
    echoed<ClearTurns>({.name = "clear turns", .name_zh = "清除圈数", .word = "clear_turns", .when = kClearTurnsCommand}, kNoFields),
    as_on_can<ReadSingleTurnAngle>(0, -3),
    echoed<ClearAngle>({.name = "clear angle", .name_zh = "清除电机角度", .word = "clear_angle", .when = kZeroRamCommand, .wrong_length = WrongLength::kEmptyTaken},
      rows(row(&ClearAngle::angle_cdeg, {.name = "new_angle", .label = "New multi-turn angle", .key = "angle_deg", .byte = 4, .wire = Wire::kI32, .scale = Scale::kHundredth, .when = kZeroRamAngle, .is_optional_in_scenarios = true}))),
    as_on_can<ReadState1>(),
    as_on_can<ClearErrors>(),
    as_on_can<ReadState2>(),
    as_on_can<ReadState3>(),
    as_on_can<OpenLoop>(-3),
    as_on_can<Torque>(-3),
    with_query<Speed>(rows(
      row(&Speed::speed_dps, {.name = "speed_target", .label = "Target speed", .key = "speed_dps", .byte = 1, .wire = Wire::kI32, .scale = Scale::kCenti, .range = Range::kMaxSpeed, .beyond = Beyond::kDriveClamps}),
      row(&Speed::iq_limit_A, {.name = "iq_limit", .label = "Limit of the torque current", .key = "iq_limit_A", .byte = 5, .wire = Wire::kI16, .scale = Scale::kIqCommand, .range = Range::kIqLimit, .when = kSpeedIqLimit, .zero_means_absent = true, .is_optional_in_scenarios = true, .optional = true}))),
    with_query<Position1>(kSerialTarget),
    with_query<Position2>(joined(kSerialTarget, moved(kSerialMaxSpeed, 8))),
    with_query<Position3>(joined(kSerialSingleTurnTarget, kDirection)),
    with_query<Position4>(joined(joined(kSerialSingleTurnTarget, kDirection), moved(kSerialMaxSpeed, 4))),
    as_on_can<Position5>(-3),
    with_query<Position6>(joined(moved(kIncrement, -3), moved(kSerialMaxSpeed, 4))),
    command<ReadParameter, ParameterValue>(traits_with<ReadParameter>(WrongLength::kSilent), filled(can_row<ReadParameter>().query, 8), filled(kParameter, 8)),
    command<WriteParameter, ParameterValue>(traits_with<WriteParameter>(WrongLength::kSilent), filled(kParameter, 8), filled(kParameter, 8)));
}();

/// Commands to the drives 1..4 in multi-drive mode. The identifier is 0x200 + CMD of a packet that
/// begins with 02.
inline constexpr auto kSerialMultiDriveRows = kMultiDriveRows;
// clang-format on

}  // namespace lk::protocol
