#include "emulator/frames/reply_values.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <utility>
#include <variant>

#include "emulator/core/servo/shaft_angles.hpp"
#include "emulator/core/servo/stored_settings.hpp"
#include "protocol/field_values.hpp"

namespace lk::emulator {
namespace {

double bytes(const protocol::Payload& data, std::size_t first, std::size_t last) {
  std::uint64_t number = 0;
  for (std::size_t n = last + 1; n-- > first;) number = number << 8U | data[n];
  return static_cast<double>(number);
}

std::string shortest(double value) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

}  // namespace

ReplyReader::ReplyReader(const ServoConfig& servo)
    : id(drive_place(servo.rom, servo).id),
      format(protocol::wire_format(servo.quirks.dialect, servo.profile.series)),
      manual_reply_bytes(servo.quirks.manual_reply_bytes) {
  const ShaftAngles angles(servo.profile, servo.quirks);
  encoder_counts = static_cast<double>(angles.max_wire_count()) + 1;
  circle_deg = static_cast<double>(angles.circle_cdeg()) / 100;
}

std::vector<ReplyValue> ReplyReader::values(std::span<const protocol::Field> fields,
                                            const protocol::Payload& data, By by) const {
  std::vector<ReplyValue> values;
  for (const protocol::Field& field : fields) {
    if (!protocol::present(field, data, format)) continue;
    std::int64_t raw = protocol::raw(field, data);
    if (by == By::kHost) raw = protocol::taken(field, raw, format);
    if (field.zero_is_none && raw == 0) continue;
    const double period = field.period == protocol::Period::kEncoder  ? encoder_counts
                          : field.period == protocol::Period::kCircle ? circle_deg
                                                                      : 0;
    values.push_back({field.key, protocol::quantity(field, raw, format), period});
  }
  return values;
}

std::vector<ReplyValue> ReplyReader::values(const protocol::Frame& frame) const {
  const auto decoded = protocol::decode_reply(frame, format);
  const auto* reply = std::get_if<protocol::ReplyFrame>(&decoded);
  if (reply == nullptr || reply->id != id) return {};
  const auto* const command = protocol::command_of(frame);
  if (!command->echoed) return values(command->reply, frame.data, By::kDrive);
  // In two parts, each exact in a double.
  return {{"DATA[1..4]", bytes(frame.data, 1, 4)}, {"DATA[5..7]", bytes(frame.data, 5, 7)}};
}

bool ReplyReader::answers_with(std::uint8_t asked, std::uint8_t said) const {
  if (asked == said) return true;
  const auto* const command = protocol::find_command(asked, format.dialect.framing);
  return manual_reply_bytes && command != nullptr && said != 0 &&
         static_cast<std::uint8_t>(command->printed) == said;
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
