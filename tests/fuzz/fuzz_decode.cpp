// One arbitrary frame of either wire, decoded and encoded again.
//
// Input: identifier (2 bytes), flags (1: kind in bits 0..1, extended in bit 2, RS-485 in bit 3),
// DLC, 8 data bytes, the dialect (3 bytes, see `format_from`), and RS-485 data beyond 8 bytes.
// Missing bytes are 0, and 0 is `legacy`.

#include <algorithm>
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

constexpr std::size_t kBytes = 15;  // maximum for a CAN frame
using Bytes = std::array<std::uint8_t, kBytes + kMaxBytes - kCanBytes>;

Bytes bytes_from(const std::uint8_t* data, std::size_t size) {
  Bytes bytes{};
  for (std::size_t k = 0; k < size && k < bytes.size(); ++k) {
    bytes[k] = data[k];
  }
  return bytes;
}

/// One bit per switch, so that all combinations occur.
WireFormat format_from(const Bytes& bytes) {
  const unsigned bits = bytes[12] | (unsigned{bytes[13]} << 8U) | (unsigned{bytes[14]} << 16U);
  const auto on = [bits](unsigned n) { return (bits >> n & 1U) != 0; };
  Dialect dialect;
  dialect.state_1 = static_cast<State1Layout>((bits & 3U) % 3U);
  dialect.clear_angle = static_cast<ClearAngleMeaning>((bits >> 2U & 3U) % 3U);
  dialect.wide_single_turn = on(4);
  dialect.wide_single_turn_target = on(5);
  dialect.pid_commands = !on(6);
  dialect.offset_command = !on(7);
  dialect.open_loop_command = on(8);
  dialect.speed_iq_limit = on(9);
  dialect.brake_command = on(10);
  dialect.parameter_commands = on(11);
  dialect.multi_drive_more = on(12);
  dialect.iq_command_limit_lsb = on(13) ? 2048 : 2000;
  dialect.iq_scale = on(14) ? CurrentScale::kSeries : CurrentScale::kManual;
  dialect.phase_current_scale = on(15) ? CurrentScale::kSeries : CurrentScale::kManual;
  dialect.reply_id_base = on(16) ? 0x180 : kSingleDriveId;
  dialect.framing = on(19) ? Framing::kSerial : Framing::kCan;
  dialect.setting_commands = dialect.clear_turns_command = on(20);
  dialect.typed_encoder = dialect.calibrate_command = on(21);
  dialect.zero_ram_len = on(21) ? 7 : 0;
  dialect.wide_zero_reply = dialect.restore_command = on(22);
  dialect.lax_length = on(23);
  constexpr Series kSeries[] = {Series::kMf, Series::kMg, Series::kMh, Series::kMs};
  return wire_format(dialect, kSeries[bits >> 17U & 3U]);
}

Frame frame_from(const Bytes& bytes) {
  Frame frame;
  frame.id = static_cast<std::uint32_t>(bytes[0] | (bytes[1] << 8));
  const bool serial = (bytes[2] & 8U) != 0;
  frame.kind = !serial                ? static_cast<FrameKind>(bytes[2] & 3U)
               : (bytes[2] & 1U) != 0 ? FrameKind::kBytes
                                      : FrameKind::kSerial;
  frame.extended = (bytes[2] & 4U) != 0;
  frame.dlc = serial ? bytes[3] % (kMaxLen + 2) : bytes[3];
  for (std::size_t k = 0; k < kCanBytes; ++k) {
    frame.data[k] = bytes[4 + k];
  }
  if (serial) {
    std::copy(bytes.begin() + kBytes, bytes.end(), frame.data.begin() + kCanBytes);
    std::fill(frame.data.begin() + frame.dlc, frame.data.end(), std::uint8_t{0});
  }
  return frame;
}

/// A drive's slot of a multi-drive command is a valid command.
void check_slots(const Query& query, const WireFormat& format) {
  for (int id = kMinId; id <= kMaxId; ++id) {
    const auto own = for_drive(id, query, format);
    if (const auto* single = std::get_if<Query>(&own)) {
      require(!std::holds_alternative<MultiCommand>(single->command));
    }
  }
}

void check_query(const Frame& frame, const WireFormat& format) {
  const auto result = decode_query(frame, format);
  if (const auto* query = std::get_if<Query>(&result)) {
    // A decoded query, encoded again, decodes equal.
    const Frame again = encode_query(query->id, query->command, format);
    const auto second = decode_query(again, format);
    require(std::holds_alternative<Query>(second));
    require(std::get<Query>(second).command == query->command);
    require(again.id == frame.id);
    check_slots(*query, format);
  }
}

void check_reply(const Frame& frame, const WireFormat& format) {
  const auto result = decode_reply(frame, format);
  if (const auto* reply = std::get_if<ReplyFrame>(&result)) {
    const Frame again = encode_reply(reply->id, reply->reply, format);
    require(again.id == frame.id && again.data[0] == frame.data[0]);
    const auto second = decode_reply(again, format);
    require(encode_reply(reply->id, std::get<ReplyFrame>(second).reply, format) == again);
  }
}

void check_length(const Frame& frame) {
  if (frame.kind == FrameKind::kData || frame.kind == FrameKind::kRemote) {
    const int bits = frame_bits(frame);
    require(bits >= 44 && bits <= 64 + 64 + (53 + 64) / 4);
  }
}

void check(const Bytes& bytes) {
  const Frame frame = frame_from(bytes);
  const WireFormat format = format_from(bytes);
  check_query(frame, format);
  check_reply(frame, format);
  check_length(frame);
}

}  // namespace
}  // namespace lk::protocol

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lk::protocol::check(lk::protocol::bytes_from(data, size));
  return 0;
}
