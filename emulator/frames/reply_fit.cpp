#include "emulator/frames/reply_fit.hpp"

#include <algorithm>
#include <iterator>
#include <variant>

#include "protocol/field_values.hpp"

namespace lk::emulator {

namespace {

/// A reply repeats the number of its parameter or setting.
bool is_about_the_same(const protocol::Frame& query, const protocol::Frame& reply,
                       const protocol::WireFormat& format) {
  const protocol::CommandInfo* const command = protocol::command_of(query);
  if (command == nullptr || protocol::find_multi_drive(query.id) != nullptr) return true;
  const auto differs = [&](const protocol::Field& field) {
    return protocol::repeats_in_reply(*command, field) &&
           protocol::present(field, query.data, format) &&
           query.data[field.byte] != reply.data[field.byte];
  };
  return std::ranges::none_of(command->query, differs);
}

/// Returns true if another query may look like the reply to this one.
bool says_the_same(const protocol::Frame& query) {
  const protocol::CommandInfo* const command = protocol::command_of(query);
  return command != nullptr && protocol::reply_says_the_same(*command);
}

}  // namespace

Fit reply_fit(const ReplyReader& reader, std::uint8_t command, const protocol::Frame& query,
              const protocol::Frame& reply) {
  if (!reader.answers_with(command, reply.data[0])) return Fit::kNo;
  if (!has_length_of_reply(reply)) return Fit::kNo;
  if (!is_about_the_same(query, reply, reader.format)) return Fit::kNo;
  protocol::Frame own = reply;
  own.id = reader.format.dialect.reply_id_base + static_cast<std::uint32_t>(reader.id);
  const auto decoded = protocol::decode_reply(own, reader.format);
  const auto* content = std::get_if<protocol::ReplyFrame>(&decoded);
  if (content == nullptr) return Fit::kNo;
  const bool same = reply.data == query.data && reply.dlc == query.dlc;
  if (std::holds_alternative<protocol::Echo>(content->reply)) {
    return same ? Fit::kEither : Fit::kNo;
  }
  if (is_serial(reply)) return same ? Fit::kEither : Fit::kYes;  // query and reply differ in length
  const bool state = protocol::has_state(reply.data[0]);
  // A state at 0 or 1 °C is taken for a query, whose DATA[1] is 0 or a direction.
  if (state) return same || reply.data[1] <= 1 ? Fit::kNo : Fit::kYes;
  return same || says_the_same(query) ? Fit::kEither : Fit::kYes;
}

bool looks_like_a_state(const protocol::Frame& frame) {
  if (!protocol::has_state(frame.data[0])) return false;
  return is_serial(frame) ? frame.dlc == protocol::kCanBytes : frame.data[1] > 1;
}

bool has_length_of_reply(const protocol::Frame& frame) {
  const protocol::CommandInfo* const command = protocol::command_of(frame);
  if (!protocol::is_serial(frame) || command == nullptr) return true;
  constexpr protocol::Opcode kBlockReads[] = {
      protocol::ReadProduct::kOpcode, protocol::ReadSettingsBlock::kOpcode,
      protocol::ReadCalibration::kOpcode, protocol::AlignReducer::kOpcode};
  const bool reads = std::ranges::find(kBlockReads, command->opcode) != std::end(kBlockReads);
  const bool writes = command->query_len != nullptr;
  const bool empty = frame.dlc == 1;
  return !(reads && empty) && !(writes && !empty);
}

bool is_data(const protocol::Frame& frame) {
  if (frame.kind == protocol::FrameKind::kSerial) return frame.dlc > 0;
  return frame.kind == protocol::FrameKind::kData && !frame.extended && frame.dlc == 8;
}

}  // namespace lk::emulator
