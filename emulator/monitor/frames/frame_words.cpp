#include "emulator/monitor/frames/frame_words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <variant>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/bus_stats.hpp"
#include "emulator/core/servo/signals.hpp"

namespace lk::emulator {
namespace {

using Values = std::vector<ReplyValue>;

/// Returns why a frame is rejected.
std::string_view reason(protocol::Reject reject) {
  if (reject == protocol::Reject::kCanFd) return "CAN FD";
  if (reject == protocol::Reject::kExtended) return "29-bit identifier";
  if (reject == protocol::Reject::kForeignId) return "no drive's identifier";
  return to_string(reject);
}

FrameWords meaningless(FrameWords words, std::string_view why, std::string_view mark) {
  words.problem = why;
  words.mark = mark;
  return words;
}

std::string_view name_of(const protocol::Frame& frame) {
  const auto* row = protocol::command_of(frame);
  return row != nullptr ? row->name : std::string_view();
}

bool is_reply(const protocol::Frame& frame, const ReplyReader& reader) {
  return std::holds_alternative<protocol::ReplyFrame>(protocol::decode_reply(frame, reader.format));
}

/// Returns the values of a reply. Decodes an echo as its query.
Values replied(const protocol::Frame& frame, const ReplyReader& reader) {
  const auto* const command = protocol::command_of(frame);
  if (command == nullptr || !is_reply(frame, reader)) return {};
  return reader.values(command->reply, frame.data,
                       command->echoed ? ReplyReader::By::kHost : ReplyReader::By::kDrive);
}

/// Returns the drive that a frame of wrong length is for; 0: several or none.
int drive_meant(const protocol::Frame& frame, protocol::Reject reject) {
  return reject == protocol::Reject::kWrongLength
             ? protocol::drive_at(frame.id, protocol::kSingleDriveId)
             : protocol::kMultiDrive;
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
  for (const ServoConfig& servo : bus.servos) {
    drives_.push_back(servo.id);
    readers_.emplace_back(servo);
  }
}

void FrameReader::update_addresses(const Bus& bus) {
  for (std::size_t n = 0; n < drives_.size(); ++n) readers_[n].id = bus.bus_address(drives_[n]).id;
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
  const bool several = words.id == protocol::kMultiDrive;
  const std::uint32_t asked = several ? frame.id : frame.data[0];
  words.command = command_text(asked);
  words.name = command_name(asked, several ? protocol::Framing::kCan : framing_of(frame));
  const ReplyReader* const reader = several ? reader_of_several(frame.id) : reader_of(words.id);
  if (reader == nullptr) return meaningless(words, to_string(Reject::kNoSuchDrive), "unknown");
  const auto decoded = protocol::decode_query(frame, reader->format);
  if (const auto* reject = std::get_if<protocol::Reject>(&decoded)) {
    return meaningless(words, reason(*reject), "unknown");
  }
  const auto* const command = several ? protocol::find_multi_drive(frame.id, framing_of(frame))
                                      : protocol::command_of(frame);
  words.quantities = reader->values(command->query, frame.data, ReplyReader::By::kHost);
  words.values = values_text(words.quantities);
  return words;
}

FrameWords FrameReader::reply(const protocol::Frame& frame) const {
  FrameWords words;
  if (frame.kind == protocol::FrameKind::kError) return meaningless(words, "error frame", "error");
  if (frame.kind == protocol::FrameKind::kBytes) {
    return meaningless(words, "no packet", "unknown");
  }
  if (frame.dlc > 0) words.command = command_text(frame.data[0]);
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
      words.values +=
          fmt::format(": {}", fmt::join(error_words(static_cast<unsigned>(errors->value)), ", "));
    }
    return words;
  }
  return meaningless(words, "no drive's identifier", "unknown");
}

std::string_view command_name(std::uint32_t asked, protocol::Framing framing) {
  const auto* row = asked > 0xFF
                        ? protocol::find_multi_drive(asked, framing)
                        : protocol::find_command(static_cast<std::uint8_t>(asked), framing);
  return row != nullptr ? row->name : std::string_view();
}

std::string command_text(std::uint32_t asked) {
  return asked > 0xFF ? fmt::format("{:03X}", asked) : fmt::format("{:02X}", asked);
}

}  // namespace lk::emulator
