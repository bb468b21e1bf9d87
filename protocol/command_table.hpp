#pragma once

/// @file The whole protocol: a row for each command, with a row for each field of its query and
/// reply. Drives do not reply to other commands. The codec, DBC files, the dissector, the table of
/// docs/reference/protocol.md, decode, scenarios and advice use these rows.

#include <variant>

#include "protocol/command_info.hpp"
#include "protocol/commands.hpp"
#include "protocol/field_rows.hpp"
#include "protocol/multi_drive_commands.hpp"
#include "protocol/replies.hpp"
#include "protocol/rows.hpp"
#include "protocol/serial_commands.hpp"
#include "protocol/switches.hpp"

namespace lk::protocol {

template <class Query, class Reply, class QueryFields, class ReplyFields>
struct CommandRow {
  using QueryType = Query;
  using ReplyType = Reply;
  CommandTraits traits;
  QueryFields query;  // FieldRow values
  ReplyFields reply;  // FieldRow values; empty if the reply repeats the query
};

namespace table {

template <class Query, class Reply, class QueryFields, class ReplyFields>
constexpr auto command(const CommandTraits& traits, QueryFields query, ReplyFields reply) {
  return CommandRow<Query, Reply, QueryFields, ReplyFields>{traits, query, reply};
}
template <class Query, class QueryFields>
constexpr auto echoed(const CommandTraits& traits, QueryFields query) {
  return command<Query, Echo>(traits, query, rows());
}

inline constexpr auto kNoFields = rows();

}  // namespace table

// clang-format off
/// Single-drive commands on CAN, sorted by DATA[0].
inline constexpr auto kCommandRows = [] {
  using namespace table;
  return rows(
    command<Restart, NoReply>({.name = "restart", .name_zh = "重启", .word = "restart", .source = Source::kSecondPrint, .when = kRestartCommand}, kNoFields, kNoFields),
    command<Calibrate, Calibrated>({.name = "calibrate encoder", .name_zh = "校准编码器", .word = "calibrate", .source = Source::kSecondPrint, .when = kCalibrateCommand, .writes_rom = true}, kNoFields, kCalibrated),
    command<WriteZeroToRom, ZeroWritten>({.name = "write present position to ROM as zero", .name_zh = "写入当前位置到 ROM 作为零点", .word = "write_zero", .source = Source::kManualAndHardware, .writes_rom = true}, kNoFields, kZeroWritten),
    command<ReadPid, Pid>({.name = "read PID", .name_zh = "读取 PID 参数", .word = "pid", .when = kPidCommands}, kNoFields, kGains),
    echoed<WritePidToRam>({.name = "write PID to RAM", .name_zh = "写入 PID 参数到 RAM", .word = "write_pid", .when = kPidCommands}, kGains),
    echoed<WritePidToRom>({.name = "write PID to ROM", .name_zh = "写入 PID 参数到 ROM", .word = "write_pid_to_rom", .when = kPidCommands, .writes_rom = true}, kGains),
    command<ReadAcceleration, Acceleration>({.name = "read acceleration", .name_zh = "读取加速度", .word = "acceleration", .when = kPidCommands}, kNoFields, kAcceleration),
    echoed<WriteAccelerationToRam>({.name = "write acceleration to RAM", .name_zh = "写入加速度到 RAM", .word = "write_acceleration", .when = kPidCommands}, kAcceleration),
    command<ReadMaxTorque, MaxTorque>({.name = "read max torque current", .name_zh = "读取最大转矩电流", .word = "max_torque", .source = Source::kHardware, .when = kMaxTorqueCommands}, kNoFields, kMaxTorque),
    echoed<WriteMaxTorque>({.name = "write max torque current to RAM", .name_zh = "写入最大转矩电流到 RAM", .word = "write_max_torque", .source = Source::kHardware, .when = kMaxTorqueCommands}, kMaxTorque),
    command<ReadStoredSetting, StoredSettingValue>({.name = "read setting", .name_zh = "读取设置", .word = "read_setting", .source = Source::kSecondPrint, .when = kSettingCommands}, kReadStoredSetting, kStoredSetting),
    command<WriteStoredSetting, StoredSettingValue>({.name = "write setting", .name_zh = "写入设置", .word = "write_setting", .source = Source::kSecondPrint, .when = kSettingCommands}, kStoredSetting, kStoredSetting),
    command<SaveSettings, SettingsSaved>({.name = "save settings", .name_zh = "保存设置", .word = "save_settings", .source = Source::kSecondPrint, .when = kSettingCommands, .writes_rom = true}, kSave, kSavedReply),
    echoed<Off>({.name = "off", .name_zh = "关闭", .word = "off", .source = Source::kManualAndHardware}, kNoFields),
    echoed<Stop>({.name = "stop", .name_zh = "停止", .word = "stop"}, kNoFields),
    echoed<Run>({.name = "run", .name_zh = "运行", .word = "run", .source = Source::kManualAndHardware}, kNoFields),
    command<Brake, BrakeState>({.name = "brake", .name_zh = "抱闸", .word = "brake", .source = Source::kNewerManuals, .when = kBrakeCommand},
      rows(row(&Brake::action, {.name = "action", .label = "Action", .key = "action", .word = "brake", .byte = 1, .range = Range::kWords, .beyond = Beyond::kNotExecuted, .values = kBrakeActions})),
      rows(row(&BrakeState::coil_powered, {.name = "coil", .label = "Coil of the brake", .key = "coil_powered", .byte = 1, .scale = Scale::kFlag, .values = kCoil}))),
    command<ReadEncoder, Encoder>({.name = "read encoder", .name_zh = "读取编码器", .word = "encoder"}, kNoFields, kEncoderReply),
    echoed<WriteOffsetToRom>({.name = "write encoder offset to ROM", .name_zh = "写入编码器零偏到 ROM", .word = "write_offset", .when = kOffsetCommand, .writes_rom = true}, kOffset),
    command<ReadMultiTurnAngle, MultiTurnAngle>({.name = "read multi-turn angle", .name_zh = "读取多圈角度", .word = "multi_turn_angle"}, kNoFields,
      rows(row(&MultiTurnAngle::angle_cdeg, {.name = "multi_turn_angle", .label = "Multi-turn angle", .key = "angle_deg", .byte = 1, .wire = Wire::kI56, .scale = Scale::kHundredth}))),
    command<ReadSingleTurnAngle, SingleTurnAngle>({.name = "read single-turn angle", .name_zh = "读取单圈角度", .word = "single_turn_angle"}, kNoFields, kSingleTurnReply),
    echoed<ClearAngle>({.name = "clear angle", .name_zh = "清除电机角度", .word = "clear_angle", .source = Source::kManualAndHardware},
      rows(row(&ClearAngle::angle_cdeg, {.name = "new_angle", .label = "New multi-turn angle", .key = "angle_deg", .byte = 4, .wire = Wire::kI32, .scale = Scale::kHundredth, .when = kSetsAngle}))),
    command<ReadState1, State1>({.name = "read state 1", .name_zh = "读取状态 1", .word = "state_1", .source = Source::kManualAndHardware}, kNoFields, kState1),
    command<ClearErrors, State1>({.name = "clear errors", .name_zh = "清除错误标志", .word = "clear_errors", .source = Source::kHardware, .printed = ReadState1::kOpcode}, kNoFields, kState1),
    command<ReadState2, State2>({.name = "read state 2", .name_zh = "读取状态 2", .word = "state_2"}, kNoFields, kState2),
    command<ReadState3, State3>({.name = "read state 3", .name_zh = "读取状态 3", .word = "state_3", .fits = Fits::kAllButMs}, kNoFields, kState3),
    command<OpenLoop, State2>({.name = "open-loop power", .name_zh = "开环输出功率", .word = "open_loop", .source = Source::kNewerManuals, .fits = Fits::kMsOnly, .when = kOpenLoopCommand},
      rows(row(&OpenLoop::power_permille, {.name = "power_target", .label = "Power", .key = "power_permille", .byte = 4, .wire = Wire::kI16, .range = Range::kOpenLoop})), kState2),
    command<Torque, State2>({.name = "torque", .name_zh = "转矩", .word = "torque", .fits = Fits::kAllButMs},
      rows(row(&Torque::iq_A, {.name = "iq_target", .label = "Target torque current", .key = "iq_A", .byte = 4, .wire = Wire::kI16, .scale = Scale::kIqCommand, .range = Range::kIqCommand})), kState2),
    command<Speed, State2>({.name = "speed", .name_zh = "速度", .word = "speed"},
      rows(row(&Speed::speed_dps, {.name = "speed_target", .label = "Target speed", .key = "speed_dps", .byte = 4, .wire = Wire::kI32, .scale = Scale::kCenti, .range = Range::kMaxSpeed, .beyond = Beyond::kDriveClamps}),
                 row(&Speed::iq_limit_A, {.name = "iq_limit", .label = "Limit of the torque current", .key = "iq_limit_A", .byte = 2, .wire = Wire::kI16, .scale = Scale::kIqCommand, .range = Range::kIqLimit, .when = kSpeedIqLimit, .zero_means_absent = true, .is_optional_in_scenarios = true})), kState2),
    command<Position1, State2>({.name = "position 1, multi-turn", .name_zh = "多圈位置 1", .word = "position_1"}, kTarget, kState2),
    command<Position2, State2>({.name = "position 2, multi-turn, max speed", .name_zh = "多圈位置 2，限速", .word = "position_2"}, joined(kTarget, kMaxSpeed), kState2),
    command<Position3, State2>({.name = "position 3, single-turn", .name_zh = "单圈位置 3", .word = "position_3", .source = Source::kHardware}, joined(kSingleTurnTarget, kDirection), kState2),
    command<Position4, State2>({.name = "position 4, single-turn, max speed", .name_zh = "单圈位置 4，限速", .word = "position_4"}, joined(joined(kSingleTurnTarget, kDirection), kMaxSpeed), kState2),
    command<Position5, State2>({.name = "position 5, increment", .name_zh = "增量位置 5", .word = "position_5", .source = Source::kHardware, .printed = Position3::kOpcode}, kIncrement, kState2),
    command<Position6, State2>({.name = "position 6, increment, max speed", .name_zh = "增量位置 6，限速", .word = "position_6", .source = Source::kHardware, .printed = Position4::kOpcode}, joined(kIncrement, kMaxSpeed), kState2),
    command<ReadParameter, ParameterValue>({.name = "read parameter", .name_zh = "读取参数", .word = "read_parameter", .source = Source::kNewerManuals, .when = kParameterCommands},
      // The name differs from that in kParameter, because here no other field depends on it.
      rows(row(&ReadParameter::id, {.name = "read_parameter", .label = "Parameter", .key = "parameter", .byte = 1, .range = Range::kWords, .beyond = Beyond::kUnknownCommand, .values = kParameters})), kParameter),
    command<WriteParameter, ParameterValue>({.name = "write parameter to RAM", .name_zh = "写入参数到 RAM", .word = "write_parameter", .source = Source::kNewerManuals, .when = kParameterCommands}, kParameter, kParameter));
}();

/// Commands to the drives 1..4 in multi-drive mode, sorted by identifier. Each drive replies as it
/// does to the single-drive command in its slot.
inline constexpr auto kMultiDriveRows = [] {
  using namespace table;
  return rows(
    command<MultiTorque, State2>({.name = "torque", .name_zh = "转矩", .fits = Fits::kAllButMs, .each = Torque::kOpcode},
      slots(&MultiTorque::iq_A, {.wire = Wire::kI16, .scale = Scale::kIqCommand, .unit = Unit::kAmpere, .range = Range::kIqCommand}, {"iq_target_1", "iq_target_2", "iq_target_3", "iq_target_4"}), kState2),
    command<MultiSpeed, State2>({.name = "speed", .name_zh = "速度", .source = Source::kNewerManuals, .when = kMultiDriveMore, .each = Speed::kOpcode},
      slots(&MultiSpeed::speed_dps, {.wire = Wire::kI16, .unit = Unit::kDegreePerSecond, .range = Range::kMaxSpeed, .beyond = Beyond::kDriveClamps}, {"speed_target_1", "speed_target_2", "speed_target_3", "speed_target_4"}), kState2),
    command<MultiPosition, State2>({.name = "position, multi-turn", .name_zh = "多圈位置", .source = Source::kNewerManuals, .when = kMultiDriveMore, .each = Position1::kOpcode},
      slots(&MultiPosition::target_cdeg, {.wire = Wire::kI16, .scale = Scale::kHundredth, .unit = Unit::kDegree, .range = Range::kMaxAngle, .beyond = Beyond::kDriveClamps}, {"angle_target_1", "angle_target_2", "angle_target_3", "angle_target_4"}), kState2),
    command<MultiCommand, State2>({.name = "any single command", .name_zh = "任意单电机命令", .source = Source::kNewerManuals, .when = kMultiDriveMore},
      slots(&MultiCommand::opcodes, {.wire = Wire::kU8}, {"command_1", "command_2", "command_3", "command_4"}), kState2));
}();
// clang-format on

namespace table {

template <template <class> class Type, class Places, class... Rows>
std::variant<typename Type<Rows>::type...> variant_of(const RowList<Places, Rows...>&);

template <class Row>
struct Query {
  using type = typename Row::QueryType;
};

template <class Variant, class... More>
struct WithMore;
template <class... Those, class... More>
struct WithMore<std::variant<Those...>, More...> {
  using type = std::variant<Those..., More...>;
};

}  // namespace table

/// Any query of a host: a type for each row here, and for each row that only serial_table.hpp has.
using Command = table::WithMore<
    decltype(table::variant_of<table::Query>(joined(kCommandRows, kMultiDriveRows))), Connect,
    Disconnect, ReadProduct, ReadSettingsBlock, WriteSettingsBlock, ReadCalibration,
    WriteCalibration, ReadDeviceType, AlignReducer, ReadSetting, WriteSettingToRam,
    WriteSettingToRom, RestoreSettings, RestoreCalibration, Restore, ClearTurns>::type;

}  // namespace lk::protocol
