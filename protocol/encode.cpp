// Encodes commands and replies as frames.

#include <algorithm>
#include <cassert>

#include "protocol/codec.hpp"
#include "protocol/row_codec.hpp"

namespace lk::protocol {

using namespace row_codec;

namespace {

/// Writes the fields of a query by its row in `kRows`. Returns the number of bytes used.
template <const auto& kRows, class Kind>
std::uint8_t write_query(Payload& data, const Kind& command, const WireFormat& format) {
  constexpr std::size_t kPlace = query_place<kRows, Kind>();
  if constexpr (kPlace == kCount<kRows>) {
    assert(false && "the wire has the command");
    return 0;
  } else {
    if constexpr (requires { Kind::kOpcode; }) data[0] = static_cast<std::uint8_t>(Kind::kOpcode);
    return write_fields<kRows, kPlace, Side::kQuery>(data, command, format);
  }
}

template <class Kind>
void write_frame(Frame& frame, const Kind& command, const WireFormat& format) {
  const bool serial = format.dialect.framing == Framing::kSerial;
  if constexpr (requires { Kind::kIdentifier; }) {
    frame.id = Kind::kIdentifier;
    if (serial) {
      write_query<kSerialMultiDriveRows>(frame.data, command, format);
    } else {
      write_query<kMultiDriveRows>(frame.data, command, format);
    }
  } else if (serial) {
    frame.dlc = write_query<kSerialRows>(frame.data, command, format);
    const CommandInfo& info = info_of(command, Framing::kSerial);
    if (info.query_len != nullptr)
      frame.dlc = static_cast<std::uint8_t>(1 + info.query_len(format));
  } else {
    write_query<kCommandRows>(frame.data, command, format);
  }
}

/// Writes a reply by the rows of CAN or RS-485. Returns the number of bytes used.
template <const auto& kRows>
struct ReplyWriter {
  Payload& data;
  const WireFormat& format;

  std::uint8_t operator()(const Echo& reply) const {
    data = reply.data;
    return reply.size;
  }
  std::uint8_t operator()(const Block& reply) const {
    data[0] = static_cast<std::uint8_t>(reply.command);
    std::copy_n(reply.data.begin(), reply.size, data.begin() + 1);
    return static_cast<std::uint8_t>(1 + reply.size);
  }
  template <class Kind>
  std::uint8_t operator()(const Kind& reply) const {
    constexpr std::size_t kPlace = reply_place<kRows, Kind>();
    if constexpr (kPlace == kCount<kRows>) {
      assert(false && "the wire has the reply");
      return 0;
    } else {
      if constexpr (requires { reply.command; }) {
        data[0] = static_cast<std::uint8_t>(reply.command);
      } else {
        data[0] = static_cast<std::uint8_t>(RowAt<kRows, kPlace>::QueryType::kOpcode);
      }
      return write_fields<kRows, kPlace, Side::kReply>(data, reply, format);
    }
  }
};

}  // namespace

Frame encode_query(int id, const Command& command, const WireFormat& format) {
  Frame frame;
  if (format.dialect.framing == Framing::kSerial) frame.kind = FrameKind::kSerial;
  if (!is_multi_drive(command)) {
    assert(id >= kMinId && id <= kMaxId);
    frame.id = kSingleDriveId + static_cast<std::uint32_t>(id);
  }
  std::visit([&](const auto& kind) { write_frame(frame, kind, format); }, command);
  return frame;
}

Frame encode_reply(int id, const Reply& reply, const WireFormat& format) {
  assert(id >= kMinId && id <= kMaxId);
  Frame frame;
  frame.id = format.dialect.reply_id_base + static_cast<std::uint32_t>(id);
  if (format.dialect.framing == Framing::kSerial) {
    frame.kind = FrameKind::kSerial;
    frame.dlc = std::visit(ReplyWriter<kSerialRows>{frame.data, format}, reply);
  } else {
    std::visit(ReplyWriter<kCommandRows>{frame.data, format}, reply);
  }
  return frame;
}

}  // namespace lk::protocol
