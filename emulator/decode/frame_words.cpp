#include "emulator/decode/frame_words.hpp"

#include <algorithm>
#include <type_traits>
#include <variant>

#include "emulator/core/bus_stats.hpp"
#include "emulator/core/signals.hpp"

namespace lk::emulator {
namespace {

using Values = std::vector<ReplyValue>;

double deg(std::int64_t cdeg) { return static_cast<double>(cdeg) / 100; }

/// Commands without quantities say nothing more than their names.
template <class Plain>
Values said(const Plain&) {
  static_assert(std::is_empty_v<Plain>, "a command with quantities has an overload below");
  return {};
}
/// What these say depends on the drive: said(const protocol::Query&, …).
Values said(const protocol::ClearAngle&) { return {}; }
Values said(const protocol::WriteParameter&) { return {}; }
Values said(const protocol::PidGains& gains) {
  return {{"angle_kp", static_cast<double>(gains.angle_kp)},
          {"angle_ki", static_cast<double>(gains.angle_ki)},
          {"speed_kp", static_cast<double>(gains.speed_kp)},
          {"speed_ki", static_cast<double>(gains.speed_ki)},
          {"iq_kp", static_cast<double>(gains.iq_kp)},
          {"iq_ki", static_cast<double>(gains.iq_ki)}};
}
Values said(const protocol::WritePidToRam& command) { return said(command.gains); }
Values said(const protocol::WritePidToRom& command) { return said(command.gains); }
Values said(const protocol::WriteAccelerationToRam& command) {
  return {{"acceleration_dps_s", static_cast<double>(command.acceleration_dps_s)}};
}
Values said(const protocol::WriteOffsetToRom& command) {
  return {{"offset_counts", static_cast<double>(command.offset_counts)}};
}
Values said(const protocol::Brake& command) {
  return {{"action", static_cast<double>(command.action)}};
}
Values said(const protocol::OpenLoop& command) {
  return {{"power_permille", static_cast<double>(command.power_permille)}};
}
Values said(const protocol::Torque& command) { return {{"iq_A", command.iq_A}}; }
Values said(const protocol::Speed& command) {
  Values values = {{"speed_dps", command.speed_dps}};
  if (command.iq_limit_A > 0) values.push_back({"iq_limit_A", command.iq_limit_A});
  return values;
}
Values said(const protocol::Position1& command) {
  return {{"angle_deg", deg(command.target_cdeg)}};
}
Values said(const protocol::Position2& command) {
  return {{"angle_deg", deg(command.target_cdeg)},
          {"max_speed_dps", static_cast<double>(command.max_speed_dps)}};
}
Values said(const protocol::Position3& command) {
  return {{"angle_deg", deg(command.target_cdeg)},
          {"direction", static_cast<double>(command.direction)}};
}
Values said(const protocol::Position4& command) {
  return {{"angle_deg", deg(command.target_cdeg)},
          {"direction", static_cast<double>(command.direction)},
          {"max_speed_dps", static_cast<double>(command.max_speed_dps)}};
}
Values said(const protocol::Position5& command) {
  return {{"turn_deg", deg(command.increment_cdeg)}};
}
Values said(const protocol::Position6& command) {
  return {{"turn_deg", deg(command.increment_cdeg)},
          {"max_speed_dps", static_cast<double>(command.max_speed_dps)}};
}
Values said(const protocol::ReadParameter& command) {
  return {{"parameter", static_cast<double>(static_cast<int>(command.id))}};
}

/// The value of a parameter has the unit of what it is.
Values said(const protocol::Parameter& parameter, const protocol::WireFormat& format) {
  using protocol::ParameterId;
  const auto number = static_cast<double>(parameter.number);
  Values values = {{"parameter", static_cast<double>(static_cast<int>(parameter.id))}};
  switch (parameter.id) {
    case ParameterId::kAngleGains:
    case ParameterId::kSpeedGains:
    case ParameterId::kCurrentGains:
      values.push_back({"kp", static_cast<double>(parameter.gains.kp)});
      values.push_back({"ki", static_cast<double>(parameter.gains.ki)});
      values.push_back({"kd", static_cast<double>(parameter.gains.kd)});
      break;
    case ParameterId::kMaxTorqueCurrent:
      values.push_back(format.series == Series::kMs
                           ? ReplyValue{"max_power_permille", number}
                           : ReplyValue{"max_current_A", number * format.iq_command_lsb_A});
      break;
    case ParameterId::kMaxSpeed:
      values.push_back({"max_speed_dps", number / 100});
      break;
    case ParameterId::kMaxAngle:
      values.push_back({"max_angle_deg", number / 100});
      break;
    case ParameterId::kCurrentRamp:
      values.push_back({"current_ramp_A_s", number / 1000});
      break;
    case ParameterId::kSpeedRamp:
      values.push_back({"acceleration_dps_s", number});
      break;
  }
  return values;
}
constexpr std::string_view kSlots[] = {"1", "2", "3", "4"};
template <class Slots>
Values by_slot(const Slots& slots) {
  Values values;
  for (std::size_t n = 0; n < slots.size(); ++n)
    values.push_back({kSlots[n], static_cast<double>(slots[n])});
  return values;
}
Values said(const protocol::MultiTorque& command) { return by_slot(command.iq_A); }
Values said(const protocol::MultiSpeed& command) { return by_slot(command.speed_dps); }
Values said(const protocol::MultiPosition& command) { return by_slot(command.target_deg); }
Values said(const protocol::MultiCommand& command) { return by_slot(command.opcodes); }

std::string hex(unsigned value, int digits) {
  std::string text;
  for (int digit = digits - 1; digit >= 0; --digit) {
    text += "0123456789ABCDEF"[value >> (4U * static_cast<unsigned>(digit)) & 0xFU];
  }
  return text;
}

std::string_view reason(protocol::Reject reject) {
  switch (reject) {
    case protocol::Reject::kErrorFrame:
      return "error frame";
    case protocol::Reject::kCanFd:
      return "CAN FD";
    case protocol::Reject::kRemote:
      return "remote request";
    case protocol::Reject::kExtended:
      return "29-bit identifier";
    case protocol::Reject::kForeignId:
      return "no drive's identifier";
    case protocol::Reject::kWrongLength:
      return "wrong length";
    case protocol::Reject::kUnknownCommand:
      return "unknown command";
  }
  return "";
}

FrameWords meaningless(FrameWords words, std::string_view why, std::string_view mark) {
  words.drawback = why;
  words.mark = mark;
  return words;
}

std::string_view name_of(const protocol::Frame& frame) {
  const auto* row = frame.dlc > 0 ? protocol::find_opcode(frame.data[0]) : nullptr;
  return row != nullptr ? row->name : std::string_view();
}

Values said(const protocol::Query& query, const protocol::WireFormat& format) {
  if (const auto* write = std::get_if<protocol::WriteParameter>(&query.command)) {
    return said(write->parameter, format);
  }
  // A command that does nothing with its payload says nothing by it.
  const bool sets = format.dialect.clear_angle == protocol::ClearAngleMeaning::kSetsAngle;
  if (const auto* clear = std::get_if<protocol::ClearAngle>(&query.command); clear && sets) {
    return {{"angle_deg", deg(clear->angle_cdeg)}};
  }
  Values values = std::visit([](const auto& command) { return said(command); }, query.command);
  // An MS drive knows no current: protocol.md §10.4.
  if (format.series == Series::kMs) {
    std::erase_if(values, [](const ReplyValue& value) { return value.name == "iq_limit_A"; });
  }
  return values;
}

/// Of a reply of the drive; an echo says what its query said.
Values replied(const protocol::Frame& frame, const ReplyReader& reader) {
  const auto decoded = protocol::decode_reply(frame, reader.format);
  const auto* reply = std::get_if<protocol::ReplyFrame>(&decoded);
  if (reply == nullptr) return {};
  if (const auto* value = std::get_if<protocol::ParameterValue>(&reply->reply)) {
    return said(value->parameter, reader.format);
  }
  if (!std::holds_alternative<protocol::Echo>(reply->reply)) return reader.values(frame);
  protocol::Frame query = frame;
  query.id = protocol::kSingleDriveId + static_cast<unsigned>(reader.id);
  const auto asked = protocol::decode_query(query, reader.format);
  const auto* known = std::get_if<protocol::Query>(&asked);
  return known != nullptr ? said(*known, reader.format) : Values{};
}

/// A frame of a wrong length was meant for a drive all the same; 0: for none, or for several.
int drive_meant(const protocol::Frame& frame, protocol::Reject reject) {
  const std::int64_t id = std::int64_t{frame.id} - protocol::kSingleDriveId;
  const bool is_for_one = id >= protocol::kMinId && id <= protocol::kMaxId;
  return reject == protocol::Reject::kWrongLength && is_for_one ? static_cast<int>(id)
                                                                : protocol::kMultiDrive;
}

bool is_reply(const protocol::Frame& frame, const ReplyReader& reader) {
  return std::holds_alternative<protocol::ReplyFrame>(protocol::decode_reply(frame, reader.format));
}

std::string in_a_row(const std::vector<std::string_view>& words) {
  std::string text;
  for (const std::string_view word : words) text.append(text.empty() ? "" : ", ").append(word);
  return text;
}

}  // namespace

std::vector<std::string_view> error_words(unsigned errors) {
  std::vector<std::string_view> words;
  for (int n = 0; n < model::kErrorKinds; ++n) {
    const auto error = static_cast<model::Error>(n);
    if ((errors & model::bit(error)) != 0) words.push_back(error_word(error));
  }
  return words;
}

FrameReader::FrameReader(const BusConfig& bus) {
  for (const ServoConfig& servo : bus.servos) readers_.emplace_back(servo);
}

const ReplyReader* FrameReader::reader_of(int id) const {
  const auto found = std::ranges::find(readers_, id, &ReplyReader::id);
  return found != readers_.end() ? &*found : nullptr;
}

const ReplyReader* FrameReader::reader_of_several(std::uint32_t frame_id) const {
  const auto knows = [frame_id](const ReplyReader& reader) {
    return protocol::knows_multi_drive(reader.format, frame_id);
  };
  const auto found = std::ranges::find_if(readers_, knows);
  if (found != readers_.end()) return &*found;
  return readers_.empty() ? nullptr : &readers_.front();
}

FrameWords FrameReader::query(const protocol::Frame& frame) const {
  FrameWords words;
  const auto whom = protocol::address(frame);
  if (const auto* reject = std::get_if<protocol::Reject>(&whom)) {
    words.id = drive_meant(frame, *reject);
    return meaningless(words, reason(*reject), "unknown");
  }
  words.id = std::get<int>(whom);
  if (words.id == protocol::kMultiDrive) {
    words.command = hex(frame.id, 3);
    const auto* row = protocol::find_multi_drive(frame.id);
    if (row != nullptr) words.name = row->name;
  } else {
    words.command = hex(frame.data[0], 2);
    words.name = name_of(frame);
  }
  const ReplyReader* const reader =
      words.id == protocol::kMultiDrive ? reader_of_several(frame.id) : reader_of(words.id);
  if (reader == nullptr) return meaningless(words, to_string(Drop::kNoSuchDrive), "unknown");
  const auto decoded = protocol::decode_query(frame, reader->format);
  if (const auto* reject = std::get_if<protocol::Reject>(&decoded)) {
    return meaningless(words, reason(*reject), "unknown");
  }
  words.quantities = said(std::get<protocol::Query>(decoded), reader->format);
  words.values = values_text(words.quantities);
  return words;
}

FrameWords FrameReader::reply(const protocol::Frame& frame) const {
  FrameWords words;
  if (frame.kind == protocol::FrameKind::kError) return meaningless(words, "error frame", "error");
  if (frame.dlc > 0) words.command = hex(frame.data[0], 2);
  words.name = name_of(frame);
  for (const ReplyReader& reader : readers_) {
    if (frame.id != reader.format.dialect.reply_id_base + static_cast<unsigned>(reader.id))
      continue;
    words.id = reader.id;
    if (!is_reply(frame, reader)) return meaningless(words, "no reply of this drive", "unknown");
    words.quantities = replied(frame, reader);
    words.values = values_text(words.quantities);
    const auto errors = std::ranges::find(words.quantities, "errors", &ReplyValue::name);
    if (errors != words.quantities.end() && errors->value != 0) {
      words.mark = "error";
      words.values += ": " + in_a_row(error_words(static_cast<unsigned>(errors->value)));
    }
    return words;
  }
  return meaningless(words, "no drive's identifier", "unknown");
}

}  // namespace lk::emulator
