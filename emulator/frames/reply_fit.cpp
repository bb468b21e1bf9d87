#include "emulator/frames/reply_fit.hpp"

#include <variant>

namespace lk::emulator {

Fit reply_fit(const ReplyReader& reader, std::uint8_t command, const protocol::Frame& query,
              const protocol::Frame& reply) {
  if (!reader.answers_with(command, reply.data[0])) return Fit::kNo;
  // The reply repeats which parameter it is about.
  const bool of_parameter = command == static_cast<std::uint8_t>(protocol::ReadParameter::kOpcode);
  if (of_parameter && protocol::find_multi_drive(query.id) == nullptr &&
      reply.data[1] != query.data[1]) {
    return Fit::kNo;
  }
  protocol::Frame own = reply;
  own.id = reader.format.dialect.reply_id_base + static_cast<std::uint32_t>(reader.id);
  const auto decoded = protocol::decode_reply(own, reader.format);
  const auto* content = std::get_if<protocol::ReplyFrame>(&decoded);
  if (content == nullptr) return Fit::kNo;
  const bool same = reply.data == query.data && reply.dlc == query.dlc;
  if (std::holds_alternative<protocol::Echo>(content->reply)) {
    return same ? Fit::kEither : Fit::kNo;
  }
  if (is_serial(reply)) return same ? Fit::kEither : Fit::kYes;  // their lengths differ
  const bool state = protocol::has_state(reply.data[0]);
  // A drive at 0 or 1 °C is taken for a host, whose DATA[1] is nothing or a direction.
  if (state) return same || reply.data[1] <= 1 ? Fit::kNo : Fit::kYes;
  return same ? Fit::kEither : Fit::kYes;
}

bool looks_like_a_state(const protocol::Frame& frame) {
  if (!protocol::has_state(frame.data[0])) return false;
  return is_serial(frame) ? frame.dlc == protocol::kCanBytes : frame.data[1] > 1;
}

bool is_data(const protocol::Frame& frame) {
  if (frame.kind == protocol::FrameKind::kSerial) return frame.dlc > 0;
  return frame.kind == protocol::FrameKind::kData && !frame.extended && frame.dlc == 8;
}

}  // namespace lk::emulator
