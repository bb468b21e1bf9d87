#pragma once

/// @file All of the wire: a row for each command, and in it one for each field of its query and of
/// its reply. What is not in here gets no reply. The codec, the DBC files, the dissector, the table
/// of docs/protocol.md, the words of decode and of scenarios and the ranges of advice come from it.

#include <array>
#include <variant>

#include "protocol/command_info.hpp"
#include "protocol/commands.hpp"
#include "protocol/replies.hpp"
#include "protocol/rows.hpp"

namespace lk::protocol {

/// A field, and where its value is in the command or the reply: what std::invoke takes.
template <class Member>
struct FieldRow {
  Member member;
  Field field;
};

template <class Query, class Reply, class QueryFields, class ReplyFields>
struct CommandRow {
  using QueryType = Query;
  using ReplyType = Reply;
  CommandTraits traits;
  QueryFields query;  // rows of FieldRow
  ReplyFields reply;  // empty for echoes, which repeat the query
};

namespace table {

template <class Member>
constexpr FieldRow<Member> row(Member member, const Field& field) {
  return {member, field};
}

template <class Query, class Reply, class QueryFields, class ReplyFields>
constexpr auto command(const CommandTraits& traits, QueryFields query, ReplyFields reply) {
  return CommandRow<Query, Reply, QueryFields, ReplyFields>{traits, query, reply};
}
template <class Query, class QueryFields>
constexpr auto echoed(const CommandTraits& traits, QueryFields query) {
  return command<Query, Echo>(traits, query, rows());
}

inline constexpr auto kNoFields = rows();

// --- where something exists; the words are those of docs/configuration.md

inline constexpr When kPidCommands{"pid_commands = true",
                                   [](const WireFormat& f) { return f.dialect.pid_commands; }};
inline constexpr When kOffsetCommand{"offset_command = true",
                                     [](const WireFormat& f) { return f.dialect.offset_command; }};
inline constexpr When kBrakeCommand{"brake_command = true",
                                    [](const WireFormat& f) { return f.dialect.brake_command; }};
inline constexpr When kOpenLoopCommand{
    "open_loop_command = true", [](const WireFormat& f) { return f.dialect.open_loop_command; }};
inline constexpr When kParameterCommands{
    "parameter_commands = true", [](const WireFormat& f) { return f.dialect.parameter_commands; }};
inline constexpr When kMultiDriveMore{
    "multi_drive_more = true", [](const WireFormat& f) { return f.dialect.multi_drive_more; }};
inline constexpr When kSetsAngle{"clear_angle = \"sets_angle\"", [](const WireFormat& f) {
                                   return f.dialect.clear_angle == ClearAngleMeaning::kSetsAngle;
                                 }};
inline constexpr When kSpeedIqLimit{"speed_iq_limit = true, not on MS", [](const WireFormat& f) {
                                      return f.dialect.speed_iq_limit && f.series != Series::kMs;
                                    }};
inline constexpr When kNarrowTarget{"single_turn_target_bits = 16", [](const WireFormat& f) {
                                      return !f.dialect.wide_single_turn_target;
                                    }};
inline constexpr When kWideTarget{"single_turn_target_bits = 32", [](const WireFormat& f) {
                                    return f.dialect.wide_single_turn_target;
                                  }};
inline constexpr When kNarrowAngle{"single_turn_bits = 16",
                                   [](const WireFormat& f) { return !f.dialect.wide_single_turn; }};
inline constexpr When kWideAngle{"single_turn_bits = 32",
                                 [](const WireFormat& f) { return f.dialect.wide_single_turn; }};
inline constexpr When kDeciVolt{"state_1 = \"decivolt\"", [](const WireFormat& f) {
                                  return f.dialect.state_1 == State1Layout::kDeciVolt;
                                }};
inline constexpr When kCentiVolt{
    "state_1 = \"centivolt\" or with bus current",
    [](const WireFormat& f) { return f.dialect.state_1 != State1Layout::kDeciVolt; }};
inline constexpr When kBusCurrent{
    "state_1 = \"centivolt_and_bus_current\"",
    [](const WireFormat& f) { return f.dialect.state_1 == State1Layout::kCentiVoltAndBusCurrent; }};
inline constexpr When kOnMs{"MS", [](const WireFormat& f) { return f.series == Series::kMs; }};
inline constexpr When kNotOnMs{"not MS",
                               [](const WireFormat& f) { return f.series != Series::kMs; }};

// --- what numbers stand for

inline constexpr Value kDirections[] = {{kClockwise, "clockwise"},
                                        {kCounterClockwise, "counterclockwise"}};
inline constexpr Value kBrakeActions[] = {
    {kBrakeEngage, "engage"}, {kBrakeRelease, "release"}, {kBrakeRead, "read"}};
inline constexpr Value kCoil[] = {{0, "unpowered, the brake holds"},
                                  {1, "powered, the brake is open"}};
inline constexpr Value kBridge[] = {{0x00, "on"}, {kBridgeOff, "off"}};
inline constexpr Flag kErrors[] = {{"error_under_voltage", "Under-voltage"},
                                   {"error_over_voltage", "Over-voltage"},
                                   {"error_driver_temperature", "Driver over-temperature"},
                                   {"error_motor_temperature", "Motor over-temperature"},
                                   {"error_over_current", "Over-current"},
                                   {"error_short_circuit", "Short circuit"},
                                   {"error_stall", "Stall"},
                                   {"error_lost_input", "Lost input"}};
inline constexpr Value kParameters[] = {
    {static_cast<unsigned>(ParameterId::kAngleGains), "gains of the angle loop"},
    {static_cast<unsigned>(ParameterId::kSpeedGains), "gains of the speed loop"},
    {static_cast<unsigned>(ParameterId::kCurrentGains), "gains of the current loop"},
    {static_cast<unsigned>(ParameterId::kMaxTorqueCurrent), "Max Torque Current, on MS Max Power"},
    {static_cast<unsigned>(ParameterId::kMaxSpeed), "Max Speed"},
    {static_cast<unsigned>(ParameterId::kMaxAngle), "Max Angle"},
    {static_cast<unsigned>(ParameterId::kCurrentRamp), "current ramp"},
    {static_cast<unsigned>(ParameterId::kSpeedRamp), "speed ramp"}};

// --- fields that several commands or replies have
// clang-format off

inline constexpr auto kGains = rows(
    row([](auto& c) -> auto& { return c.gains.angle_kp; }, {.name = "angle_kp", .label = "Kp of the angle loop", .key = "angle_kp", .byte = 2}),
    row([](auto& c) -> auto& { return c.gains.angle_ki; }, {.name = "angle_ki", .label = "Ki of the angle loop", .key = "angle_ki", .byte = 3}),
    row([](auto& c) -> auto& { return c.gains.speed_kp; }, {.name = "speed_kp", .label = "Kp of the speed loop", .key = "speed_kp", .byte = 4}),
    row([](auto& c) -> auto& { return c.gains.speed_ki; }, {.name = "speed_ki", .label = "Ki of the speed loop", .key = "speed_ki", .byte = 5}),
    row([](auto& c) -> auto& { return c.gains.iq_kp; }, {.name = "iq_kp", .label = "Kp of the current loop", .key = "iq_kp", .byte = 6}),
    row([](auto& c) -> auto& { return c.gains.iq_ki; }, {.name = "iq_ki", .label = "Ki of the current loop", .key = "iq_ki", .byte = 7}));

inline constexpr auto kAcceleration = rows(
    row([](auto& c) -> auto& { return c.acceleration_dps_s; }, {.name = "acceleration", .label = "Acceleration", .key = "acceleration_dps_s", .byte = 4, .wire = Wire::kI32, .unit = Unit::kDegreePerSecond2, .range = Range::kNotNegative, .beyond = Beyond::kDriveClamps}));

inline constexpr auto kOffset = rows(
    row([](auto& c) -> auto& { return c.offset_counts; }, {.name = "encoder_offset", .label = "Encoder offset", .key = "offset_counts", .word = "offset", .byte = 6, .wire = Wire::kU16, .unit = Unit::kCounts, .range = Range::kEncoder, .beyond = Beyond::kDriveClamps, .period = Period::kEncoder}));

inline constexpr auto kTarget = rows(
    row([](auto& c) -> auto& { return c.target_cdeg; }, {.name = "angle_target", .label = "Target angle", .key = "angle_deg", .byte = 4, .wire = Wire::kI32, .scale = Scale::kHundredth, .unit = Unit::kDegree, .range = Range::kMaxAngle, .beyond = Beyond::kDriveClamps}));

inline constexpr auto kSingleTurnTarget = rows(
    row([](auto& c) -> auto& { return c.target_cdeg; }, {.name = "single_turn_target", .label = "Target angle, single-turn", .key = "angle_deg", .byte = 4, .wire = Wire::kU16, .scale = Scale::kHundredth, .unit = Unit::kDegree, .range = Range::kCircle, .beyond = Beyond::kNotExecuted, .when = kNarrowTarget}),
    row([](auto& c) -> auto& { return c.target_cdeg; }, {.name = "single_turn_target", .label = "Target angle, single-turn", .key = "angle_deg", .byte = 4, .wire = Wire::kU32, .scale = Scale::kHundredth, .unit = Unit::kDegree, .range = Range::kCircle, .beyond = Beyond::kNotExecuted, .when = kWideTarget}));

inline constexpr auto kDirection = rows(
    row([](auto& c) -> auto& { return c.direction; }, {.name = "direction", .label = "Direction", .key = "direction", .byte = 1, .range = Range::kWords, .beyond = Beyond::kNotExecuted, .values = kDirections}));

inline constexpr auto kIncrement = rows(
    row([](auto& c) -> auto& { return c.increment_cdeg; }, {.name = "increment", .label = "Increment", .key = "turn_deg", .byte = 4, .wire = Wire::kI32, .scale = Scale::kHundredth, .unit = Unit::kDegree}));

inline constexpr auto kMaxSpeed = rows(
    row([](auto& c) -> auto& { return c.max_speed_dps; }, {.name = "max_speed", .label = "Max speed", .key = "max_speed_dps", .byte = 2, .wire = Wire::kU16, .unit = Unit::kDegreePerSecond, .may_be_unsaid = true}));

inline constexpr auto kTemperature = rows(
    row([](auto& c) -> auto& { return c.temperature_C; }, {.name = "temperature", .label = "Temperature", .key = "temperature_C", .byte = 1, .wire = Wire::kI8, .unit = Unit::kCelsius}));

inline constexpr auto kState1 = joined(kTemperature, rows(
    row(&State1::voltage_V, {.name = "voltage", .label = "Voltage", .key = "voltage_V", .byte = 3, .wire = Wire::kU16, .scale = Scale::kVoltage, .unit = Unit::kVolt, .when = kDeciVolt}),
    row(&State1::voltage_V, {.name = "voltage", .label = "Voltage", .key = "voltage_V", .byte = 2, .wire = Wire::kU16, .scale = Scale::kVoltage, .unit = Unit::kVolt, .when = kCentiVolt}),
    row(&State1::errors, {.name = "errors", .label = "Errors", .key = "errors", .byte = 7, .flags = kErrors}),
    row(&State1::bus_current_A, {.name = "bus_current", .label = "Bus current", .key = "bus_current_A", .byte = 4, .wire = Wire::kI16, .scale = Scale::kCenti, .unit = Unit::kAmpere, .when = kBusCurrent}),
    row(&State1::bridge_on, {.name = "bridge", .label = "Bridge", .key = "bridge_on", .byte = 6, .scale = Scale::kBridge, .when = kBusCurrent, .values = kBridge})));

inline constexpr auto kState2 = joined(kTemperature, rows(
    row(&State2::iq_A, {.name = "iq", .label = "Torque current", .key = "iq_A", .byte = 2, .wire = Wire::kI16, .scale = Scale::kIqReply, .unit = Unit::kAmpere, .range = Range::kIqReply, .when = kNotOnMs}),
    row(&State2::power_permille, {.name = "power", .label = "Power", .key = "power_permille", .byte = 2, .wire = Wire::kI16, .unit = Unit::kPermille, .range = Range::kPowerReply, .when = kOnMs}),
    row(&State2::speed_dps, {.name = "speed", .label = "Speed", .key = "speed_dps", .byte = 4, .wire = Wire::kI16, .unit = Unit::kDegreePerSecond}),
    row(&State2::encoder_counts, {.name = "encoder", .label = "Encoder", .key = "encoder_counts", .word = "encoder", .byte = 6, .wire = Wire::kU16, .unit = Unit::kCounts, .period = Period::kEncoder})));

inline constexpr auto kState3 = joined(kTemperature, rows(
    row(&State3::i_a_A, {.name = "i_a", .label = "Current of phase a", .key = "i_a_A", .byte = 2, .wire = Wire::kI16, .scale = Scale::kPhaseCurrent, .unit = Unit::kAmpere}),
    row(&State3::i_b_A, {.name = "i_b", .label = "Current of phase b", .key = "i_b_A", .byte = 4, .wire = Wire::kI16, .scale = Scale::kPhaseCurrent, .unit = Unit::kAmpere}),
    row(&State3::i_c_A, {.name = "i_c", .label = "Current of phase c", .key = "i_c_A", .byte = 6, .wire = Wire::kI16, .scale = Scale::kPhaseCurrent, .unit = Unit::kAmpere})));

inline constexpr auto kEncoderReply = rows(
    row(&Encoder::encoder_counts, {.name = "encoder_position", .label = "Encoder", .key = "encoder_counts", .word = "encoder", .byte = 2, .wire = Wire::kU16, .unit = Unit::kCounts, .period = Period::kEncoder}),
    row(&Encoder::raw_counts, {.name = "encoder_raw", .label = "Encoder, raw", .key = "raw_counts", .byte = 4, .wire = Wire::kU16, .unit = Unit::kCounts, .period = Period::kEncoder}),
    row(&Encoder::offset_counts, {.name = "encoder_offset", .label = "Encoder offset", .key = "offset_counts", .word = "offset", .byte = 6, .wire = Wire::kU16, .unit = Unit::kCounts, .period = Period::kEncoder}));

inline constexpr auto kSingleTurnReply = rows(
    row(&SingleTurnAngle::angle_cdeg, {.name = "single_turn_angle", .label = "Single-turn angle", .key = "angle_deg", .byte = 6, .wire = Wire::kU16, .scale = Scale::kHundredth, .unit = Unit::kDegree, .range = Range::kTurn, .beyond = Beyond::kDriveClamps, .when = kNarrowAngle, .period = Period::kCircle}),
    row(&SingleTurnAngle::angle_cdeg, {.name = "single_turn_angle", .label = "Single-turn angle", .key = "angle_deg", .byte = 4, .wire = Wire::kU32, .scale = Scale::kHundredth, .unit = Unit::kDegree, .when = kWideAngle, .period = Period::kCircle}));

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
    row(kNumber, {.name = "register_max_torque_current", .label = "Max Torque Current", .key = "max_current_A", .byte = 4, .wire = Wire::kI16, .scale = Scale::kIqCommand, .unit = Unit::kAmpere, .range = Range::kMaxCurrent, .beyond = Beyond::kDriveClamps, .when = kNotOnMs, .parameter = number(ParameterId::kMaxTorqueCurrent)}),
    row(kNumber, {.name = "register_max_power", .label = "Max Power", .key = "max_power_permille", .byte = 4, .wire = Wire::kI16, .unit = Unit::kPermille, .range = Range::kMaxCurrent, .beyond = Beyond::kDriveClamps, .when = kOnMs, .parameter = number(ParameterId::kMaxTorqueCurrent)}),
    row(kNumber, {.name = "register_max_speed", .label = "Max Speed", .key = "max_speed_dps", .byte = 4, .wire = Wire::kI32, .scale = Scale::kHundredth, .unit = Unit::kDegreePerSecond, .range = Range::kSpeedSetting, .beyond = Beyond::kDriveClamps, .parameter = number(ParameterId::kMaxSpeed)}),
    row(kNumber, {.name = "register_max_angle", .label = "Max Angle", .key = "max_angle_deg", .byte = 4, .wire = Wire::kI32, .scale = Scale::kHundredth, .unit = Unit::kDegree, .range = Range::kAngleSetting, .beyond = Beyond::kDriveClamps, .parameter = number(ParameterId::kMaxAngle)}),
    row(kNumber, {.name = "register_current_ramp", .label = "Current ramp", .key = "current_ramp_A_s", .byte = 4, .wire = Wire::kI32, .scale = Scale::kThousandth, .unit = Unit::kAmperePerSecond, .range = Range::kCurrentRamp, .beyond = Beyond::kDriveClamps, .parameter = number(ParameterId::kCurrentRamp)}),
    row(kNumber, {.name = "register_speed_ramp", .label = "Speed ramp", .key = "acceleration_dps_s", .byte = 4, .wire = Wire::kI32, .unit = Unit::kDegreePerSecond2, .range = Range::kNotNegative, .beyond = Beyond::kDriveClamps, .parameter = number(ParameterId::kSpeedRamp)}));

/// The same field for each of the drives 1..4: `member` is an array.
template <class Member>
constexpr auto slots(Member member, Field field, const std::array<std::string_view, kMultiDriveSlots>& names) {
  constexpr std::array<std::string_view, kMultiDriveSlots> kLabels = {"Drive 1", "Drive 2", "Drive 3", "Drive 4"};
  constexpr std::array<std::string_view, kMultiDriveSlots> kKeys = {"1", "2", "3", "4"};
  const auto slot = [&]<std::size_t N>(std::integral_constant<std::size_t, N>) {
    field.name = names[N], field.label = kLabels[N], field.key = kKeys[N], field.byte = 2 * N;
    return row([member](auto& c) -> auto& { return std::get<N>(c.*member); }, field);
  };
  return rows(slot(std::integral_constant<std::size_t, 0>{}), slot(std::integral_constant<std::size_t, 1>{}),
                    slot(std::integral_constant<std::size_t, 2>{}), slot(std::integral_constant<std::size_t, 3>{}));
}

}  // namespace table

/// Commands to one drive; their bytes ascend.
inline constexpr auto kCommandRows = [] {
  using namespace table;
  return rows(
    command<WriteZeroToRom, ZeroWritten>({.name = "write present position to ROM as zero", .word = "write_zero", .source = Source::kManualAndHardware}, kNoFields, kOffset),
    command<ReadPid, Pid>({.name = "read PID", .word = "pid", .when = kPidCommands}, kNoFields, kGains),
    echoed<WritePidToRam>({.name = "write PID to RAM", .word = "write_pid", .when = kPidCommands}, kGains),
    echoed<WritePidToRom>({.name = "write PID to ROM", .word = "write_pid_to_rom", .when = kPidCommands}, kGains),
    command<ReadAcceleration, Acceleration>({.name = "read acceleration", .word = "acceleration", .when = kPidCommands}, kNoFields, kAcceleration),
    echoed<WriteAccelerationToRam>({.name = "write acceleration to RAM", .word = "write_acceleration", .when = kPidCommands}, kAcceleration),
    echoed<Off>({.name = "off", .word = "off", .source = Source::kManualAndHardware}, kNoFields),
    echoed<Stop>({.name = "stop", .word = "stop"}, kNoFields),
    echoed<Run>({.name = "run", .word = "run", .source = Source::kManualAndHardware}, kNoFields),
    command<Brake, BrakeState>({.name = "brake", .word = "brake", .source = Source::kNewerManuals, .when = kBrakeCommand},
      rows(row(&Brake::action, {.name = "action", .label = "Action", .key = "action", .word = "brake", .byte = 1, .range = Range::kWords, .beyond = Beyond::kNotExecuted, .values = kBrakeActions})),
      rows(row(&BrakeState::coil_powered, {.name = "coil", .label = "Coil of the brake", .key = "coil_powered", .byte = 1, .scale = Scale::kFlag, .values = kCoil}))),
    command<ReadEncoder, Encoder>({.name = "read encoder", .word = "encoder"}, kNoFields, kEncoderReply),
    echoed<WriteOffsetToRom>({.name = "write encoder offset to ROM", .word = "write_offset", .when = kOffsetCommand}, kOffset),
    command<ReadMultiTurnAngle, MultiTurnAngle>({.name = "read multi-turn angle", .word = "multi_turn_angle"}, kNoFields,
      rows(row(&MultiTurnAngle::angle_cdeg, {.name = "multi_turn_angle", .label = "Multi-turn angle", .key = "angle_deg", .byte = 1, .wire = Wire::kI56, .scale = Scale::kHundredth, .unit = Unit::kDegree}))),
    command<ReadSingleTurnAngle, SingleTurnAngle>({.name = "read single-turn angle", .word = "single_turn_angle"}, kNoFields, kSingleTurnReply),
    echoed<ClearAngle>({.name = "clear angle", .word = "clear_angle", .source = Source::kManualAndHardware},
      rows(row(&ClearAngle::angle_cdeg, {.name = "new_angle", .label = "New multi-turn angle", .key = "angle_deg", .byte = 4, .wire = Wire::kI32, .scale = Scale::kHundredth, .unit = Unit::kDegree, .when = kSetsAngle}))),
    command<ReadState1, State1>({.name = "read state 1", .word = "state_1", .source = Source::kManualAndHardware}, kNoFields, kState1),
    command<ClearErrors, State1>({.name = "clear errors", .word = "clear_errors", .source = Source::kHardware}, kNoFields, kState1),
    command<ReadState2, State2>({.name = "read state 2", .word = "state_2"}, kNoFields, kState2),
    command<ReadState3, State3>({.name = "read state 3", .word = "state_3", .fits = Fits::kAllButMs}, kNoFields, kState3),
    command<OpenLoop, State2>({.name = "open-loop power", .word = "open_loop", .source = Source::kNewerManuals, .fits = Fits::kMsOnly, .when = kOpenLoopCommand},
      rows(row(&OpenLoop::power_permille, {.name = "power_target", .label = "Power", .key = "power_permille", .byte = 4, .wire = Wire::kI16, .unit = Unit::kPermille, .range = Range::kOpenLoop})), kState2),
    command<Torque, State2>({.name = "torque", .word = "torque", .fits = Fits::kAllButMs},
      rows(row(&Torque::iq_A, {.name = "iq_target", .label = "Target torque current", .key = "iq_A", .byte = 4, .wire = Wire::kI16, .scale = Scale::kIqCommand, .unit = Unit::kAmpere, .range = Range::kIqCommand})), kState2),
    command<Speed, State2>({.name = "speed", .word = "speed"},
      rows(row(&Speed::speed_dps, {.name = "speed_target", .label = "Target speed", .key = "speed_dps", .byte = 4, .wire = Wire::kI32, .scale = Scale::kCenti, .unit = Unit::kDegreePerSecond, .range = Range::kMaxSpeed, .beyond = Beyond::kDriveClamps}),
                 row(&Speed::iq_limit_A, {.name = "iq_limit", .label = "Limit of the torque current", .key = "iq_limit_A", .byte = 2, .wire = Wire::kI16, .scale = Scale::kIqCommand, .unit = Unit::kAmpere, .range = Range::kIqLimit, .when = kSpeedIqLimit, .zero_is_none = true, .may_be_unsaid = true})), kState2),
    command<Position1, State2>({.name = "position 1, multi-turn", .word = "position_1"}, kTarget, kState2),
    command<Position2, State2>({.name = "position 2, multi-turn, max speed", .word = "position_2"}, joined(kTarget, kMaxSpeed), kState2),
    command<Position3, State2>({.name = "position 3, single-turn", .word = "position_3", .source = Source::kHardware}, joined(kSingleTurnTarget, kDirection), kState2),
    command<Position4, State2>({.name = "position 4, single-turn, max speed", .word = "position_4"}, joined(joined(kSingleTurnTarget, kDirection), kMaxSpeed), kState2),
    command<Position5, State2>({.name = "position 5, increment", .word = "position_5", .source = Source::kHardware}, kIncrement, kState2),
    command<Position6, State2>({.name = "position 6, increment, max speed", .word = "position_6", .source = Source::kHardware}, joined(kIncrement, kMaxSpeed), kState2),
    command<ReadParameter, ParameterValue>({.name = "read parameter", .word = "read_parameter", .source = Source::kNewerManuals, .when = kParameterCommands},
      // A name of its own: nothing else depends on it here.
      rows(row(&ReadParameter::id, {.name = "read_parameter", .label = "Parameter", .key = "parameter", .byte = 1, .range = Range::kWords, .beyond = Beyond::kUnknownCommand, .values = kParameters})), kParameter),
    echoed<WriteParameter>({.name = "write parameter to RAM", .word = "write_parameter", .source = Source::kNewerManuals, .when = kParameterCommands}, kParameter));
}();

/// Commands to the drives 1..4 in multi-drive mode; their identifiers ascend. What each drive answers is the reply to the
/// command of its slot.
inline constexpr auto kMultiDriveRows = [] {
  using namespace table;
  return rows(
    command<MultiTorque, State2>({.name = "torque", .fits = Fits::kAllButMs, .each = Torque::kOpcode},
      slots(&MultiTorque::iq_A, {.wire = Wire::kI16, .scale = Scale::kIqCommand, .unit = Unit::kAmpere, .range = Range::kIqCommand}, {"iq_target_1", "iq_target_2", "iq_target_3", "iq_target_4"}), kState2),
    command<MultiSpeed, State2>({.name = "speed", .source = Source::kNewerManuals, .when = kMultiDriveMore, .each = Speed::kOpcode},
      slots(&MultiSpeed::speed_dps, {.wire = Wire::kI16, .unit = Unit::kDegreePerSecond, .range = Range::kMaxSpeed, .beyond = Beyond::kDriveClamps}, {"speed_target_1", "speed_target_2", "speed_target_3", "speed_target_4"}), kState2),
    command<MultiPosition, State2>({.name = "position, multi-turn", .source = Source::kNewerManuals, .when = kMultiDriveMore, .each = Position1::kOpcode},
      slots(&MultiPosition::target_deg, {.wire = Wire::kI16, .unit = Unit::kDegree, .range = Range::kMaxAngle, .beyond = Beyond::kDriveClamps}, {"angle_target_1", "angle_target_2", "angle_target_3", "angle_target_4"}), kState2),
    command<MultiCommand, State2>({.name = "any single command", .source = Source::kNewerManuals, .when = kMultiDriveMore},
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

}  // namespace table

/// What a host asks: one alternative for each row.
using Command = decltype(table::variant_of<table::Query>(joined(kCommandRows, kMultiDriveRows)));

}  // namespace lk::protocol
