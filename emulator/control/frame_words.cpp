#include "emulator/control/frame_words.hpp"

#include <algorithm>
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
  return {};
}
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
Values said(const protocol::WriteParameter& command) {
  const protocol::Parameter& parameter = command.parameter;
  return {{"parameter", static_cast<double>(static_cast<int>(parameter.id))},
          {"kp", static_cast<double>(parameter.gains.kp)},
          {"ki", static_cast<double>(parameter.gains.ki)},
          {"kd", static_cast<double>(parameter.gains.kd)},
          {"number", static_cast<double>(parameter.number)}};
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

std::string error_words(unsigned errors) {
  std::string text;
  for (int n = 0; n < model::kErrorKinds; ++n) {
    const auto error = static_cast<model::Error>(n);
    if ((errors & model::bit(error)) != 0)
      text.append(text.empty() ? "" : ", ").append(error_word(error));
  }
  return text;
}

}  // namespace

FrameReader::FrameReader(const BusConfig& bus) {
  for (const ServoConfig& servo : bus.servos) readers_.emplace_back(servo);
}

const ReplyReader* FrameReader::reader_of(int id) const {
  const auto found = std::ranges::find(readers_, id, &ReplyReader::id);
  return found != readers_.end() ? &*found : nullptr;
}

FrameWords FrameReader::query(const protocol::Frame& frame) const {
  FrameWords words;
  const auto whom = protocol::address(frame);
  if (const auto* reject = std::get_if<protocol::Reject>(&whom)) {
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
  const ReplyReader* const reader = words.id != protocol::kMultiDrive
                                        ? reader_of(words.id)
                                        : (readers_.empty() ? nullptr : &readers_.front());
  if (reader == nullptr) return meaningless(words, to_string(Drop::kNoSuchDrive), "unknown");
  const auto decoded = protocol::decode_query(frame, reader->format);
  if (const auto* reject = std::get_if<protocol::Reject>(&decoded)) {
    return meaningless(words, reason(*reject), "unknown");
  }
  words.values = values_text(std::visit([](const auto& command) { return said(command); },
                                        std::get<protocol::Query>(decoded).command));
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
    const Values values = reader.values(frame);
    if (values.empty()) return meaningless(words, "no reply of this drive", "unknown");
    const auto errors = std::ranges::find(values, "errors", &ReplyValue::name);
    words.values = values_text(values);
    if (errors != values.end() && errors->value != 0) {
      words.mark = "error";
      words.values += ": " + error_words(static_cast<unsigned>(errors->value));
    }
    return words;
  }
  return meaningless(words, "no drive's identifier", "unknown");
}

}  // namespace lk::emulator
