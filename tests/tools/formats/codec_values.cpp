#include "tests/tools/formats/codec_values.hpp"

#include <stdexcept>

namespace lk::test {
namespace {

using namespace protocol;

Values read(const PidGains& gains) {
  return {{"angle_kp", gains.angle_kp}, {"angle_ki", gains.angle_ki}, {"speed_kp", gains.speed_kp},
          {"speed_ki", gains.speed_ki}, {"iq_kp", gains.iq_kp},       {"iq_ki", gains.iq_ki}};
}

/// Scales of docs/reference/protocol.md §10.5.
Values read(const Parameter& parameter, const WireFormat& format) {
  Values values = {{"parameter", static_cast<double>(parameter.id)}};
  const auto loop = [&](const std::string& name) {
    values[name + "_kp"] = parameter.gains.kp;
    values[name + "_ki"] = parameter.gains.ki;
    values[name + "_kd"] = parameter.gains.kd;
  };
  switch (parameter.id) {
    case ParameterId::kAngleGains:
      loop("angle");
      break;
    case ParameterId::kSpeedGains:
      loop("speed");
      break;
    case ParameterId::kCurrentGains:
      loop("iq");
      break;
    case ParameterId::kMaxTorqueCurrent:
      if (format.series == Series::kMs) {
        values["register_max_power"] = parameter.number / 10.0;
      } else {
        values["register_max_torque_current"] = parameter.number * format.iq_command_lsb_A;
      }
      break;
    case ParameterId::kMaxSpeed:
      values["register_max_speed"] = parameter.number / 100.0;
      break;
    case ParameterId::kMaxAngle:
      values["register_max_angle"] = parameter.number / 100.0;
      break;
    case ParameterId::kCurrentRamp:
      values["register_current_ramp"] = parameter.number / 1000.0;
      break;
    case ParameterId::kSpeedRamp:
      values["register_speed_ramp"] = parameter.number;
      break;
  }
  return values;
}

/// Scales of docs/reference/protocol.md §10.9. A frame contains only the fields of its setting.
Values read(const StoredSetting& setting, const WireFormat& format) {
  Values values = {{"setting", setting.table}};
  const auto loop = [&](const std::string& name) {
    values["setting_" + name + "_kp"] = setting.gains.kp;
    values["setting_" + name + "_ki"] = setting.gains.ki;
    values["setting_" + name + "_kd"] = setting.gains.kd;
  };
  if (setting.table == 0xA0) loop("angle");
  if (setting.table == 0xA4) loop("speed");
  if (setting.table == 0xA8) loop("iq");
  if (setting.table != 0x05) return values;
  values["setting_item"] = setting.item;
  const double number = setting.number;
  if (setting.item == 0x0A) values["setting_driver_id"] = number;
  if (setting.item == 0x0B) values["setting_bus_type"] = number;
  if (setting.item == 0x0C) values["setting_rs485_rate"] = number;
  if (setting.item == 0x0D) values["setting_can_rate"] = number;
  if (setting.item == 0xE0 && format.series == Series::kMs) {
    values["setting_max_power"] = number / 10;
  } else if (setting.item == 0xE0) {
    values["setting_max_torque_current"] = number * format.iq_command_lsb_A;
  }
  if (setting.item == 0xE2) values["setting_max_speed"] = number / 100;
  if (setting.item == 0xE4) values["setting_max_angle"] = number / 100;
  if (setting.item == 0xEA) values["setting_current_ramp"] = number / 1000;
  if (setting.item == 0xEC) values["setting_speed_ramp"] = number;
  return values;
}

struct Reader {
  const WireFormat& format;

  // Queries; those without values come last.
  Values operator()(const WritePidToRam& query) const { return read(query.gains); }
  Values operator()(const WritePidToRom& query) const { return read(query.gains); }
  Values operator()(const WriteAccelerationToRam& query) const {
    return {{"acceleration", query.acceleration_dps_s}};
  }
  Values operator()(const Brake& query) const { return {{"action", query.action}}; }
  Values operator()(const WriteOffsetToRom& query) const {
    return {{"encoder_offset", query.offset_counts}};
  }
  Values operator()(const ClearAngle& query) const {
    if (format.dialect.clear_angle != ClearAngleMeaning::kSetsAngle) return {};
    return {{"new_angle", query.angle_cdeg / 100.0}};
  }
  Values operator()(const OpenLoop& query) const {
    return {{"power_target", query.power_permille / 10.0}};
  }
  Values operator()(const Torque& query) const { return {{"iq_target", query.iq_A}}; }
  Values operator()(const Speed& query) const {
    Values values = {{"speed_target", query.speed_dps}};
    if (format.dialect.speed_iq_limit && format.series != Series::kMs)
      values["iq_limit"] = query.iq_limit_A;
    return values;
  }
  Values operator()(const Position1& query) const {
    return {{"angle_target", static_cast<double>(query.target_cdeg) / 100.0}};
  }
  Values operator()(const Position2& query) const {
    return {{"max_speed", query.max_speed_dps},
            {"angle_target", static_cast<double>(query.target_cdeg) / 100.0}};
  }
  Values operator()(const Position3& query) const {
    return {{"direction", query.direction},
            {"single_turn_target", static_cast<double>(query.target_cdeg) / 100.0}};
  }
  Values operator()(const Position4& query) const {
    return {{"direction", query.direction},
            {"max_speed", query.max_speed_dps},
            {"single_turn_target", static_cast<double>(query.target_cdeg) / 100.0}};
  }
  Values operator()(const Position5& query) const {
    return {{"increment", query.increment_cdeg / 100.0}};
  }
  Values operator()(const Position6& query) const {
    return {{"max_speed", query.max_speed_dps}, {"increment", query.increment_cdeg / 100.0}};
  }
  Values operator()(const ReadParameter& query) const {
    return {{"read_parameter", static_cast<double>(query.id)}};
  }
  Values operator()(const WriteParameter& query) const { return read(query.parameter, format); }
  Values operator()(const WriteMaxTorque& query) const {
    return {{"max_torque", query.max_torque_lsb}};
  }
  Values operator()(const ReadStoredSetting& query) const {
    Values values = {{"read_setting", query.setting.table}};
    if (query.setting.table == 0x05) values["read_setting_item"] = query.setting.item;
    return values;
  }
  Values operator()(const WriteStoredSetting& query) const { return read(query.setting, format); }
  Values operator()(const SaveSettings& query) const {
    return {{"save", query.table}, {"save_item", query.item}};
  }
  Values operator()(const MultiTorque& query) const { return slots("iq_target_", query.iq_A); }
  Values operator()(const MultiSpeed& query) const {
    return slots("speed_target_", query.speed_dps);
  }
  Values operator()(const MultiPosition& query) const {
    Values values = slots("angle_target_", query.target_cdeg);
    for (auto& [name, value] : values) value /= 100.0;
    return values;
  }
  Values operator()(const MultiCommand& query) const { return slots("command_", query.opcodes); }

  // Replies.
  Values operator()(const ZeroWritten& reply) const {
    return {
        {format.dialect.wide_zero_reply ? "zero_offset" : "encoder_offset", reply.offset_counts}};
  }
  Values operator()(const Calibrated& reply) const {
    return {{"align_value", reply.align_value},
            {"align_ratio", reply.align_ratio},
            {"calibration", reply.status}};
  }
  Values operator()(const MaxTorque& reply) const { return {{"max_torque", reply.max_torque_lsb}}; }
  Values operator()(const StoredSettingValue& reply) const { return read(reply.setting, format); }
  Values operator()(const SettingsSaved& reply) const {
    return {{"save", reply.table}, {"saved", reply.saved ? 1.0 : 0.0}};
  }
  Values operator()(const Pid& reply) const { return read(reply.gains); }
  Values operator()(const Acceleration& reply) const {
    return {{"acceleration", reply.acceleration_dps_s}};
  }
  Values operator()(const BrakeState& reply) const {
    return {{"coil", reply.coil_powered ? 1.0 : 0.0}};
  }
  Values operator()(const Encoder& reply) const {
    return {{"encoder_position", reply.encoder_counts},
            {"encoder_raw", reply.raw_counts},
            {"encoder_offset", reply.offset_counts}};
  }
  Values operator()(const MultiTurnAngle& reply) const {
    return {{"multi_turn_angle", static_cast<double>(reply.angle_cdeg) / 100.0}};
  }
  Values operator()(const SingleTurnAngle& reply) const {
    return {{"single_turn_angle", reply.angle_cdeg / 100.0}};
  }
  Values operator()(const State1& reply) const {
    Values values = {{"temperature", reply.temperature_C}, {"voltage", reply.voltage_V}};
    if (format.dialect.state_1 == State1Layout::kCentiVoltAndBusCurrent) {
      values["bus_current"] = reply.bus_current_A;
      values["bridge"] = reply.bridge_on ? 0x00 : 0x10;
    }
    // docs/reference/protocol.md §10.1
    const char* const errors[] = {
        "under_voltage", "over_voltage", "driver_temperature", "motor_temperature", "over_current",
        "short_circuit", "stall",        "lost_input"};
    for (unsigned bit = 0; bit < 8; ++bit) {
      values[std::string("error_") + errors[bit]] = (reply.errors & 1U << bit) != 0 ? 1 : 0;
    }
    return values;
  }
  Values operator()(const State2& reply) const {
    Values values = {{"temperature", reply.temperature_C},
                     {"speed", reply.speed_dps},
                     {"encoder", reply.encoder_counts}};
    if (format.series == Series::kMs) {
      values["power"] = reply.power_permille / 10.0;
    } else {
      values["iq"] = reply.iq_A;
    }
    return values;
  }
  Values operator()(const State3& reply) const {
    return {{"temperature", reply.temperature_C},
            {"i_a", reply.i_a_A},
            {"i_b", reply.i_b_A},
            {"i_c", reply.i_c_A}};
  }
  Values operator()(const ParameterValue& reply) const { return read(reply.parameter, format); }

  // 0x90 has a type on RS-485 only.
  Values operator()(const ReadEncoder&) const { return {}; }
  // CAN frames never decode to these: serial_codec_test.
  Values operator()(const ReadSetting&) const { return of_the_other_wire(); }
  Values operator()(const WriteSettingToRam&) const { return of_the_other_wire(); }
  Values operator()(const WriteSettingToRom&) const { return of_the_other_wire(); }
  Values operator()(const SettingValue&) const { return of_the_other_wire(); }
  Values operator()(const SettingWritten&) const { return of_the_other_wire(); }
  Values operator()(const DeviceType&) const { return of_the_other_wire(); }
  Values operator()(const Block&) const { return of_the_other_wire(); }
  static Values of_the_other_wire() { throw std::runtime_error("RS-485 alone has it"); }

  template <class Silent>
  Values operator()(const Silent&) const {
    static_assert(std::is_empty_v<Silent>, "what says something has a reader above");
    return {};
  }

  template <class Numbers>
  static Values slots(const std::string& name, const Numbers& numbers) {
    Values values;
    for (std::size_t n = 0; n < numbers.size(); ++n)
      values[name + std::to_string(n + 1)] = numbers[n];
    return values;
  }
};

}  // namespace

Values query_values(const Frame& frame, const WireFormat& format) {
  const auto decoded = decode_query(frame, format);
  const auto* query = std::get_if<Query>(&decoded);
  if (query == nullptr) throw std::runtime_error("no query of this format");
  return std::visit(Reader{format}, query->command);
}

Values reply_values(const Frame& frame, const WireFormat& format) {
  const auto decoded = decode_reply(frame, format);
  const auto* reply = std::get_if<ReplyFrame>(&decoded);
  if (reply == nullptr) throw std::runtime_error("no reply of this format");
  if (std::holds_alternative<Echo>(reply->reply)) return query_values(frame, format);
  return std::visit(
      [&format](const auto& content) -> Values {
        if constexpr (std::is_same_v<std::decay_t<decltype(content)>, Echo>) {
          return {};
        } else {
          return Reader{format}(content);
        }
      },
      reply->reply);
}

}  // namespace lk::test
