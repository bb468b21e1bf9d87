#include "emulator/record/reply_values.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <utility>
#include <variant>

#include "emulator/core/shaft_angles.hpp"

namespace lk::emulator {
namespace {

using Values = std::vector<ReplyValue>;

double bytes(const protocol::Payload& data, std::size_t first, std::size_t last) {
  std::uint64_t number = 0;
  for (std::size_t n = last + 1; n-- > first;) number = number << 8U | data[n];
  return static_cast<double>(number);
}

Values read(const protocol::Echo& echo, const ReplyReader&) {
  // In two parts, which a double holds exactly.
  return {{"DATA[1..4]", bytes(echo.data, 1, 4)}, {"DATA[5..7]", bytes(echo.data, 5, 7)}};
}
Values read(const protocol::ZeroWritten& zero, const ReplyReader& reader) {
  return {{"offset_counts", static_cast<double>(zero.offset_counts), reader.encoder_counts}};
}
Values read(const protocol::Pid& pid, const ReplyReader&) {
  const auto& gains = pid.gains;
  return {{"angle_kp", static_cast<double>(gains.angle_kp)},
          {"angle_ki", static_cast<double>(gains.angle_ki)},
          {"speed_kp", static_cast<double>(gains.speed_kp)},
          {"speed_ki", static_cast<double>(gains.speed_ki)},
          {"iq_kp", static_cast<double>(gains.iq_kp)},
          {"iq_ki", static_cast<double>(gains.iq_ki)}};
}
Values read(const protocol::Acceleration& acceleration, const ReplyReader&) {
  return {{"acceleration_dps_s", static_cast<double>(acceleration.acceleration_dps_s)}};
}
Values read(const protocol::BrakeState& brake, const ReplyReader&) {
  return {{"coil_powered", brake.coil_powered ? 1.0 : 0.0}};
}
Values read(const protocol::Encoder& encoder, const ReplyReader& reader) {
  return {{"encoder_counts", static_cast<double>(encoder.encoder_counts), reader.encoder_counts},
          {"raw_counts", static_cast<double>(encoder.raw_counts), reader.encoder_counts},
          {"offset_counts", static_cast<double>(encoder.offset_counts), reader.encoder_counts}};
}
Values read(const protocol::MultiTurnAngle& angle, const ReplyReader&) {
  return {{"angle_deg", static_cast<double>(angle.angle_cdeg) / 100}};
}
Values read(const protocol::SingleTurnAngle& angle, const ReplyReader& reader) {
  return {{"angle_deg", static_cast<double>(angle.angle_cdeg) / 100, reader.circle_deg}};
}
Values read(const protocol::State1& state, const ReplyReader& reader) {
  Values values = {{"temperature_C", state.temperature_C},
                   {"voltage_V", state.voltage_V},
                   {"errors", static_cast<double>(state.errors)}};
  if (reader.format.dialect.state_1 == protocol::State1Layout::kCentiVoltAndBusCurrent) {
    values.push_back({"bus_current_A", state.bus_current_A});
    values.push_back({"bridge_on", state.bridge_on ? 1.0 : 0.0});
  }
  return values;
}
Values read(const protocol::State2& state, const ReplyReader& reader) {
  const bool ms = reader.format.series == Series::kMs;
  return {{"temperature_C", state.temperature_C},
          // Power as it was on the wire.
          ms ? ReplyValue{"power_permille", std::round(1000 * state.power)}
             : ReplyValue{"iq_A", state.iq_A},
          {"speed_dps", state.speed_dps},
          {"encoder_counts", static_cast<double>(state.encoder_counts), reader.encoder_counts}};
}
Values read(const protocol::State3& state, const ReplyReader&) {
  return {{"temperature_C", state.temperature_C},
          {"i_a_A", state.i_a_A},
          {"i_b_A", state.i_b_A},
          {"i_c_A", state.i_c_A}};
}
Values read(const protocol::ParameterValue& value, const ReplyReader&) {
  const protocol::Parameter& parameter = value.parameter;
  return {{"parameter", static_cast<double>(parameter.id)},
          {"kp", static_cast<double>(parameter.gains.kp)},
          {"ki", static_cast<double>(parameter.gains.ki)},
          {"kd", static_cast<double>(parameter.gains.kd)},
          {"number", static_cast<double>(parameter.number)}};
}

std::string shortest(double value) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

}  // namespace

ReplyReader::ReplyReader(const ServoConfig& servo)
    : id(servo.id),
      format(protocol::wire_format(servo.quirks.dialect, servo.profile.series)),
      manual_reply_bytes(servo.quirks.manual_reply_bytes) {
  const ShaftAngles angles(servo.profile, servo.quirks);
  encoder_counts = static_cast<double>(angles.max_wire_count()) + 1;
  circle_deg = static_cast<double>(angles.circle_cdeg()) / 100;
}

std::vector<ReplyValue> ReplyReader::values(const protocol::Frame& frame) const {
  const auto decoded = protocol::decode_reply(frame, format);
  const auto* reply = std::get_if<protocol::ReplyFrame>(&decoded);
  if (reply == nullptr || reply->id != id) return {};
  return std::visit([this](const auto& content) { return read(content, *this); }, reply->reply);
}

bool ReplyReader::answers_with(std::uint8_t asked, std::uint8_t said) const {
  if (asked == said) return true;
  constexpr std::pair<std::uint8_t, std::uint8_t> kMisprints[] = {
      {0x9B, 0x9A}, {0xA7, 0xA5}, {0xA8, 0xA6}};
  return manual_reply_bytes &&
         std::ranges::find(kMisprints, std::pair(asked, said)) != std::end(kMisprints);
}

double value_difference(const ReplyValue& a, const ReplyValue& b) {
  const double difference = b.value - a.value;
  return a.period > 0 ? std::remainder(difference, a.period) : difference;
}

std::string values_text(const std::vector<ReplyValue>& values) {
  std::string text;
  for (const ReplyValue& one : values) {
    text.append(text.empty() ? "" : ", ").append(one.name).append(" ");
    text += shortest(one.value);
  }
  return text;
}

}  // namespace lk::emulator
