#include "emulator/formats/fields.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

namespace lk::formats {
namespace {

using protocol::Opcode;
using protocol::WireFormat;
using Fields = std::vector<Field>;

/// A number of whole bytes from DATA[byte] on.
Field unsigned_field(std::string_view name, std::string_view label, unsigned byte, unsigned bytes,
                     double lsb = 1, std::string_view unit = "") {
  return {.name = name,
          .label = label,
          .first_bit = 8 * byte,
          .bits = 8 * bytes,
          .lsb = lsb,
          .unit = unit,
          .raw_max = static_cast<std::int64_t>((std::uint64_t{1} << 8 * bytes) - 1)};
}

Field signed_field(std::string_view name, std::string_view label, unsigned byte, unsigned bytes,
                   double lsb = 1, std::string_view unit = "") {
  const std::int64_t half = std::int64_t{1} << (8 * bytes - 1);
  Field field = unsigned_field(name, label, byte, bytes, lsb, unit);
  field.is_signed = true;
  field.raw_min = -half;
  field.raw_max = half - 1;
  return field;
}

Field within(Field field, std::int64_t raw_min, std::int64_t raw_max) {
  field.raw_min = raw_min;
  field.raw_max = raw_max;
  return field;
}

Field with_values(Field field, std::vector<Value> values) {
  field.values = std::move(values);
  return field;
}

Field iq_command(std::string_view name, std::string_view label, unsigned byte,
                 const WireFormat& format) {
  const std::int64_t limit = format.dialect.iq_command_limit_lsb;
  return within(signed_field(name, label, byte, 2, format.iq_command_lsb_A, "A"), -limit, limit);
}

Field angle_target() { return signed_field("angle_target", "Target angle", 4, 4, 0.01, "deg"); }
Field increment() { return signed_field("increment", "Increment", 4, 4, 0.01, "deg"); }
Field max_speed() { return unsigned_field("max_speed", "Max speed", 2, 2, 1, "deg/s"); }
Field acceleration() { return signed_field("acceleration", "Acceleration", 4, 4, 1, "deg/s^2"); }
Field temperature() { return signed_field("temperature", "Temperature", 1, 1, 1, "degC"); }

Field direction() {
  return with_values(
      unsigned_field("direction", "Direction", 1, 1),
      {{protocol::kClockwise, "clockwise"}, {protocol::kCounterClockwise, "counter-clockwise"}});
}

// The drive judges targets itself, so beyond a turn they are refused and not clamped.
Field single_turn_target(const WireFormat& format) {
  return unsigned_field("single_turn_target", "Target angle, single-turn", 4,
                        format.dialect.wide_single_turn_target ? 4 : 2, 0.01, "deg");
}

Fields gains() {
  return {unsigned_field("angle_kp", "Kp of the angle loop", 2, 1),
          unsigned_field("angle_ki", "Ki of the angle loop", 3, 1),
          unsigned_field("speed_kp", "Kp of the speed loop", 4, 1),
          unsigned_field("speed_ki", "Ki of the speed loop", 5, 1),
          unsigned_field("iq_kp", "Kp of the current loop", 6, 1),
          unsigned_field("iq_ki", "Ki of the current loop", 7, 1)};
}

Fields speed_target(const WireFormat& format) {
  Fields fields = {signed_field("speed_target", "Target speed", 4, 4, 0.01, "deg/s")};
  if (format.dialect.speed_iq_limit) {
    // A negative one is none, and so is 0.
    const std::int64_t limit = format.dialect.iq_command_limit_lsb;
    fields.push_back(
        within(iq_command("iq_limit", "Limit of the torque current", 2, format), 0, limit));
  }
  return fields;
}

Field parameter_id(std::string_view name) {
  using protocol::ParameterId;
  const auto number = [](ParameterId id) { return static_cast<unsigned>(id); };
  return with_values(
      unsigned_field(name, "Parameter", 1, 1),
      {{number(ParameterId::kAngleGains), "gains of the angle loop"},
       {number(ParameterId::kSpeedGains), "gains of the speed loop"},
       {number(ParameterId::kCurrentGains), "gains of the current loop"},
       {number(ParameterId::kMaxTorqueCurrent), "Max Torque Current, on MS Max Power"},
       {number(ParameterId::kMaxSpeed), "Max Speed"},
       {number(ParameterId::kMaxAngle), "Max Angle"},
       {number(ParameterId::kCurrentRamp), "current ramp"},
       {number(ParameterId::kSpeedRamp), "speed ramp"}});
}

Fields parameter_values(const WireFormat& format) {
  using protocol::ParameterId;
  Fields fields = {parameter_id("parameter")};
  const auto add = [&fields](ParameterId id, Field field) {
    field.parameter = static_cast<int>(id);
    fields.push_back(std::move(field));
  };
  add(ParameterId::kAngleGains, unsigned_field("angle_kp", "Kp of the angle loop", 2, 2));
  add(ParameterId::kAngleGains, unsigned_field("angle_ki", "Ki of the angle loop", 4, 2));
  add(ParameterId::kAngleGains, unsigned_field("angle_kd", "Kd of the angle loop", 6, 2));
  add(ParameterId::kSpeedGains, unsigned_field("speed_kp", "Kp of the speed loop", 2, 2));
  add(ParameterId::kSpeedGains, unsigned_field("speed_ki", "Ki of the speed loop", 4, 2));
  add(ParameterId::kSpeedGains, unsigned_field("speed_kd", "Kd of the speed loop", 6, 2));
  add(ParameterId::kCurrentGains, unsigned_field("iq_kp", "Kp of the current loop", 2, 2));
  add(ParameterId::kCurrentGains, unsigned_field("iq_ki", "Ki of the current loop", 4, 2));
  add(ParameterId::kCurrentGains, unsigned_field("iq_kd", "Kd of the current loop", 6, 2));
  add(ParameterId::kMaxTorqueCurrent,
      format.series == protocol::Series::kMs
          ? signed_field("register_max_power", "Max Power", 4, 2, 0.1, "%")
          : signed_field("register_max_torque_current", "Max Torque Current", 4, 2,
                         format.iq_command_lsb_A, "A"));
  add(ParameterId::kMaxSpeed, signed_field("register_max_speed", "Max Speed", 4, 4, 0.01, "deg/s"));
  add(ParameterId::kMaxAngle, signed_field("register_max_angle", "Max Angle", 4, 4, 0.01, "deg"));
  add(ParameterId::kCurrentRamp,
      signed_field("register_current_ramp", "Current ramp", 4, 4, 0.001, "A/s"));
  add(ParameterId::kSpeedRamp,
      signed_field("register_speed_ramp", "Speed ramp", 4, 4, 1, "deg/s^2"));
  return fields;
}

Fields state_1(const WireFormat& format) {
  const bool tenths = format.dialect.state_1 == protocol::State1Layout::kDeciVolt;
  Fields fields = {temperature(), unsigned_field("voltage", "Voltage", tenths ? 3 : 2, 2,
                                                 format.voltage_lsb_V, "V")};
  if (format.dialect.state_1 == protocol::State1Layout::kCentiVoltAndBusCurrent) {
    fields.push_back(signed_field("bus_current", "Bus current", 4, 2, 0.01, "A"));
    fields.push_back(
        with_values(unsigned_field("bridge", "Bridge", 6, 1), {{0x00, "on"}, {0x10, "off"}}));
  }
  // All eight in every generation: `legacy` shows two of them and leaves the others 0.
  static constexpr std::array<std::string_view, 8> kNames = {"error_under_voltage",
                                                             "error_over_voltage",
                                                             "error_driver_temperature",
                                                             "error_motor_temperature",
                                                             "error_over_current",
                                                             "error_short_circuit",
                                                             "error_stall",
                                                             "error_lost_input"};
  static constexpr std::array<std::string_view, 8> kLabels = {"Under-voltage",
                                                              "Over-voltage",
                                                              "Driver over-temperature",
                                                              "Motor over-temperature",
                                                              "Over-current",
                                                              "Short circuit",
                                                              "Stall",
                                                              "Lost input"};
  for (unsigned bit = 0; bit < 8; ++bit) {
    fields.push_back({.name = kNames[bit],
                      .label = kLabels[bit],
                      .first_bit = 56 + bit,
                      .bits = 1,
                      .raw_max = 1,
                      .values = {{0, "no"}, {1, "yes"}}});
  }
  return fields;
}

Fields state_2(const WireFormat& format) {
  const bool power = format.series == protocol::Series::kMs;
  const std::int64_t limit =
      power ? protocol::kPowerReplyLimit_permille : protocol::kIqReplyLimit_lsb;
  const Field effort = power
                           ? signed_field("power", "Power", 2, 2, 0.1, "%")
                           : signed_field("iq", "Torque current", 2, 2, format.iq_reply_lsb_A, "A");
  return {temperature(), within(effort, -limit, limit),
          signed_field("speed", "Speed", 4, 2, 1, "deg/s"),
          unsigned_field("encoder", "Encoder", 6, 2)};
}

Fields state_3(const WireFormat& format) {
  const double lsb_A = format.phase_current_lsb_A;
  return {temperature(), signed_field("i_a", "Current of phase a", 2, 2, lsb_A, "A"),
          signed_field("i_b", "Current of phase b", 4, 2, lsb_A, "A"),
          signed_field("i_c", "Current of phase c", 6, 2, lsb_A, "A")};
}

Field encoder_offset() { return unsigned_field("encoder_offset", "Encoder offset", 6, 2); }

Field single_turn_angle(const WireFormat& format) {
  const bool wide = format.dialect.wide_single_turn;
  const Field field = unsigned_field("single_turn_angle", "Single-turn angle", wide ? 4 : 6,
                                     wide ? 4 : 2, 0.01, "deg");
  // A wide one spans a turn of the output on some motors.
  return wide ? field : within(field, 0, protocol::kTurn_cdeg - 1);
}

}  // namespace

Fields query_fields(Opcode opcode, const WireFormat& format) {
  switch (opcode) {
    case Opcode::kWritePidToRam:
    case Opcode::kWritePidToRom:
      return gains();
    case Opcode::kWriteAccelerationToRam:
      return {acceleration()};
    case Opcode::kBrake:
      return {with_values(unsigned_field("action", "Action", 1, 1),
                          {{protocol::kBrakeEngage, "engage"},
                           {protocol::kBrakeRelease, "release"},
                           {protocol::kBrakeRead, "read"}})};
    case Opcode::kWriteOffsetToRom:
      return {encoder_offset()};
    case Opcode::kClearAngle:
      if (format.dialect.clear_angle != protocol::ClearAngleMeaning::kSetsAngle) return {};
      return {signed_field("new_angle", "New multi-turn angle", 4, 4, 0.01, "deg")};
    case Opcode::kOpenLoop:
      return {within(signed_field("power_target", "Power", 4, 2, 0.1, "%"),
                     -protocol::kOpenLoopLimit_permille, protocol::kOpenLoopLimit_permille)};
    case Opcode::kTorque:
      return {iq_command("iq_target", "Target torque current", 4, format)};
    case Opcode::kSpeed:
      return speed_target(format);
    case Opcode::kPosition1:
      return {angle_target()};
    case Opcode::kPosition2:
      return {max_speed(), angle_target()};
    case Opcode::kPosition3:
      return {direction(), single_turn_target(format)};
    case Opcode::kPosition4:
      return {direction(), max_speed(), single_turn_target(format)};
    case Opcode::kPosition5:
      return {increment()};
    case Opcode::kPosition6:
      return {max_speed(), increment()};
    case Opcode::kReadParameter:
      // Not `parameter`, on which values hang that nobody has to give here.
      return {parameter_id("read_parameter")};
    case Opcode::kWriteParameter:
      return parameter_values(format);
    case Opcode::kWriteZeroToRom:
    case Opcode::kReadPid:
    case Opcode::kReadAcceleration:
    case Opcode::kOff:
    case Opcode::kStop:
    case Opcode::kRun:
    case Opcode::kReadEncoder:
    case Opcode::kReadMultiTurnAngle:
    case Opcode::kReadSingleTurnAngle:
    case Opcode::kReadState1:
    case Opcode::kClearErrors:
    case Opcode::kReadState2:
    case Opcode::kReadState3:
      return {};
  }
  assert(false && "an opcode comes from the table");
  return {};
}

Fields reply_fields(Opcode opcode, const WireFormat& format) {
  if (is_echo(opcode)) return query_fields(opcode, format);
  switch (opcode) {
    case Opcode::kWriteZeroToRom:
      return {encoder_offset()};
    case Opcode::kReadPid:
      return gains();
    case Opcode::kReadAcceleration:
      return {acceleration()};
    case Opcode::kBrake:
      return {with_values(unsigned_field("coil", "Coil of the brake", 1, 1),
                          {{0, "unpowered, the brake holds"}, {1, "powered, the brake is open"}})};
    case Opcode::kReadEncoder:
      return {unsigned_field("encoder_position", "Encoder", 2, 2),
              unsigned_field("encoder_raw", "Encoder, raw", 4, 2), encoder_offset()};
    case Opcode::kReadMultiTurnAngle:
      return {signed_field("multi_turn_angle", "Multi-turn angle", 1, 7, 0.01, "deg")};
    case Opcode::kReadSingleTurnAngle:
      return {single_turn_angle(format)};
    case Opcode::kReadState1:
    case Opcode::kClearErrors:
      return state_1(format);
    case Opcode::kReadState3:
      return state_3(format);
    case Opcode::kReadParameter:
      return parameter_values(format);
    case Opcode::kReadState2:
    case Opcode::kOpenLoop:
    case Opcode::kTorque:
    case Opcode::kSpeed:
    case Opcode::kPosition1:
    case Opcode::kPosition2:
    case Opcode::kPosition3:
    case Opcode::kPosition4:
    case Opcode::kPosition5:
    case Opcode::kPosition6:
      return state_2(format);
    case Opcode::kWritePidToRam:
    case Opcode::kWritePidToRom:
    case Opcode::kWriteAccelerationToRam:
    case Opcode::kOff:
    case Opcode::kStop:
    case Opcode::kRun:
    case Opcode::kWriteOffsetToRom:
    case Opcode::kClearAngle:
    case Opcode::kWriteParameter:
      break;
  }
  assert(false && "an echo, or a reply of its own");
  return {};
}

Fields multi_drive_fields(std::uint32_t id, const WireFormat& format) {
  static constexpr std::array<std::array<std::string_view, 4>, 4> kNames = {{
      {"iq_target_1", "iq_target_2", "iq_target_3", "iq_target_4"},
      {"speed_target_1", "speed_target_2", "speed_target_3", "speed_target_4"},
      {"angle_target_1", "angle_target_2", "angle_target_3", "angle_target_4"},
      {"command_1", "command_2", "command_3", "command_4"},
  }};
  static constexpr std::array<std::string_view, 4> kLabels = {"Drive 1", "Drive 2", "Drive 3",
                                                              "Drive 4"};
  Fields fields;
  for (unsigned slot = 0; slot < protocol::kMultiDriveSlots; ++slot) {
    const unsigned byte = 2 * slot;
    if (id == protocol::kMultiDriveId) {
      fields.push_back(iq_command(kNames[0][slot], kLabels[slot], byte, format));
    } else if (id == protocol::kMultiSpeedId) {
      fields.push_back(signed_field(kNames[1][slot], kLabels[slot], byte, 2, 1, "deg/s"));
    } else if (id == protocol::kMultiPositionId) {
      fields.push_back(signed_field(kNames[2][slot], kLabels[slot], byte, 2, 1, "deg"));
    } else {
      assert(id == protocol::kMultiCommandId);
      std::vector<Value> values = {{protocol::kNoCommand, "nothing"}};
      for (const Value& command : commands(format)) values.push_back(command);
      fields.push_back(
          with_values(unsigned_field(kNames[3][slot], kLabels[slot], byte, 1), std::move(values)));
    }
  }
  return fields;
}

bool is_echo(Opcode opcode) {
  constexpr std::array kEchoes = {Opcode::kWritePidToRam,
                                  Opcode::kWritePidToRom,
                                  Opcode::kWriteAccelerationToRam,
                                  Opcode::kOff,
                                  Opcode::kStop,
                                  Opcode::kRun,
                                  Opcode::kClearAngle,
                                  Opcode::kWriteOffsetToRom,
                                  Opcode::kWriteParameter};
  return std::ranges::find(kEchoes, opcode) != kEchoes.end();
}

std::vector<Value> commands(const WireFormat& format) {
  std::vector<Value> known;
  for (const auto& row : protocol::kOpcodes) {
    if (answers(format, row.opcode)) known.push_back({static_cast<unsigned>(row.opcode), row.name});
  }
  return known;
}

}  // namespace lk::formats
