// One frame, whatever it is, through decode and back.
//
// Input: identifier (2 bytes), flags (1: kind in bits 0..1, extended in bit 2), DLC, 8 data bytes;
// missing bytes are 0.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "protocol/codec.hpp"
#include "protocol/frame_bits.hpp"

namespace lk::protocol {
namespace {

void require(bool condition) {
  if (!condition) {
    std::abort();
  }
}

Frame frame_from(const std::uint8_t* data, std::size_t size) {
  std::array<std::uint8_t, 12> bytes{};
  for (std::size_t k = 0; k < size && k < bytes.size(); ++k) {
    bytes[k] = data[k];
  }
  Frame frame;
  frame.id = static_cast<std::uint32_t>(bytes[0] | (bytes[1] << 8));
  frame.kind = static_cast<FrameKind>(bytes[2] & 3U);
  frame.extended = (bytes[2] & 4U) != 0;
  frame.dlc = bytes[3];
  for (std::size_t k = 0; k < frame.data.size(); ++k) {
    frame.data[k] = bytes[4 + k];
  }
  return frame;
}

void check_query(const Frame& frame) {
  const auto result = decode_query(frame, kLegacyFormat);
  if (const auto* query = std::get_if<Query>(&result)) {
    // What was understood, encoded again, is understood the same.
    const Frame again = encode_query(query->id, query->command, kLegacyFormat);
    const auto second = decode_query(again, kLegacyFormat);
    require(std::holds_alternative<Query>(second));
    require(std::get<Query>(second).command == query->command);
    require(again.id == frame.id);
  }
}

void check_reply(const Frame& frame) {
  const auto result = decode_reply(frame, kLegacyFormat);
  if (const auto* reply = std::get_if<ReplyFrame>(&result)) {
    const Frame again = encode_reply(reply->id, reply->reply, kLegacyFormat);
    require(again.id == frame.id && again.data[0] == frame.data[0]);
    const auto second = decode_reply(again, kLegacyFormat);
    require(encode_reply(reply->id, std::get<ReplyFrame>(second).reply, kLegacyFormat) == again);
  }
}

void check_length(const Frame& frame) {
  if (frame.kind == FrameKind::kData || frame.kind == FrameKind::kRemote) {
    const int bits = frame_bits(frame);
    require(bits >= 44 && bits <= 64 + 64 + (53 + 64) / 4);
  }
}

void check(const Frame& frame) {
  check_query(frame);
  check_reply(frame);
  check_length(frame);
}

}  // namespace
}  // namespace lk::protocol

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lk::protocol::check(lk::protocol::frame_from(data, size));
  return 0;
}
