#include "protocol/serial_framing.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

#include "protocol/multi_drive_commands.hpp"
#include "protocol/opcodes.hpp"

namespace lk::protocol {
namespace {

/// A 02 packet corresponds to the CAN identifier kBroadcastBase + CMD.
constexpr std::uint32_t kBroadcastBase = 0x200;
static_assert(kBroadcastBase + 0x80 == MultiTorque::kIdentifier);

/// Returns true if CAN has an identifier for the command.
constexpr bool is_broadcast_command(std::uint8_t command) {
  return command == 0x80 || command == 0x81 || command == 0x82 || command == 0x88;
}

constexpr bool is_broadcast(const Frame& frame) { return frame.id >= MultiTorque::kIdentifier; }

/// Converts a complete 3E packet to a frame. Pre: its sums are correct.
Frame packet_of(std::span<const std::uint8_t> bytes) {
  Frame frame;
  frame.kind = FrameKind::kSerial;
  frame.id = kSingleDriveId + bytes[2];
  frame.dlc = static_cast<std::uint8_t>(1 + bytes[3]);
  frame.data[0] = bytes[1];
  std::copy_n(bytes.begin() + kHeaderBytes, bytes[3], frame.data.begin() + 1);
  return frame;
}

Frame broadcast_of(std::span<const std::uint8_t> bytes) {
  Frame frame;
  frame.kind = FrameKind::kSerial;
  frame.id = kBroadcastBase + bytes[1];
  frame.dlc = kCanBytes;
  std::copy_n(bytes.begin() + 2, kCanBytes, frame.data.begin());
  return frame;
}

bool has_good_header(std::span<const std::uint8_t> bytes) {
  return sum_of(bytes.first(kHeaderBytes - 1)) == bytes[kHeaderBytes - 1];
}
/// Returns the bytes of a 3E packet with this header. Pre: the header's sum is correct.
std::size_t packet_size(std::span<const std::uint8_t> bytes) {
  return bytes[3] == 0 ? kHeaderBytes : kHeaderBytes + bytes[3] + 1;
}
bool has_good_data(std::span<const std::uint8_t> bytes) {
  return bytes[3] == 0 ||
         sum_of(bytes.subspan(kHeaderBytes, bytes[3])) == bytes[kHeaderBytes + bytes[3]];
}
bool is_good_broadcast(std::span<const std::uint8_t> bytes) {
  return is_broadcast_command(bytes[1]) &&
         sum_of(bytes.first(kBroadcastBytes - 1)) == bytes[kBroadcastBytes - 1];
}

}  // namespace

std::uint8_t sum_of(std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint8_t>(std::accumulate(bytes.begin(), bytes.end(), 0U));
}

WireBytes wire_bytes(const Frame& frame) {
  assert(is_serial(frame) && frame.dlc <= kMaxBytes);
  WireBytes out;
  const auto add = [&out](std::uint8_t byte) { out.bytes[out.size++] = byte; };
  const auto add_sum = [&](std::size_t from) { add(sum_of(out.view().subspan(from))); };
  const auto add_data = [&](std::size_t from) {
    for (std::size_t n = from; n < frame.dlc; ++n) add(frame.data[n]);
  };
  if (frame.kind == FrameKind::kBytes || frame.dlc == 0) {
    add_data(0);
  } else if (is_broadcast(frame)) {
    add(kBroadcastStart);
    add(static_cast<std::uint8_t>(frame.id - kBroadcastBase));
    add_data(0);
    add_sum(0);
  } else {
    assert(frame.dlc <= 1 + kMaxLen);
    add(kPacketStart);
    add(frame.data[0]);
    add(static_cast<std::uint8_t>(frame.id - kSingleDriveId));
    add(static_cast<std::uint8_t>(frame.dlc - 1));
    add_sum(0);
    add_data(1);
    if (frame.dlc > 1) add_sum(kHeaderBytes);
  }
  return out;
}

std::optional<Frame> packet_at(std::span<const std::uint8_t> bytes) {
  if (bytes.size() >= kHeaderBytes && bytes[0] == kPacketStart && has_good_header(bytes) &&
      bytes[3] <= kMaxLen && bytes.size() >= packet_size(bytes) && has_good_data(bytes)) {
    return packet_of(bytes);
  }
  if (bytes.size() >= kBroadcastBytes && bytes[0] == kBroadcastStart && is_good_broadcast(bytes)) {
    return broadcast_of(bytes);
  }
  return std::nullopt;
}

Frame bytes_frame(std::span<const std::uint8_t> bytes) {
  assert(bytes.size() <= kMaxBytes);
  const auto packet = packet_at(bytes);
  if (packet && wire_bytes(*packet).size == bytes.size()) return *packet;
  Frame frame;
  frame.kind = FrameKind::kBytes;
  frame.dlc = static_cast<std::uint8_t>(bytes.size());
  std::ranges::copy(bytes, frame.data.begin());
  return frame;
}

void append_frames(std::span<const std::uint8_t> bytes, std::vector<Frame>& out) {
  Frame rest;  // bytes outside of packets
  rest.kind = FrameKind::kBytes;
  rest.dlc = 0;
  const auto end_rest = [&] {
    if (rest.dlc > 0) out.push_back(rest);
    rest.dlc = 0;
    rest.data = {};
  };
  while (!bytes.empty()) {
    if (const auto packet = packet_at(bytes)) {
      end_rest();
      out.push_back(*packet);
      bytes = bytes.subspan(wire_bytes(*packet).size);
      continue;
    }
    rest.data[rest.dlc++] = bytes.front();
    bytes = bytes.subspan(1);
    if (rest.dlc == rest.data.size()) end_rest();
  }
  end_rest();
}

std::optional<Frame> Receiver::feed(std::uint8_t byte, std::chrono::nanoseconds begin,
                                    std::chrono::nanoseconds end) {
  const auto rest = last_end_ ? begin - *last_end_ : std::chrono::nanoseconds::max();
  const bool rested = rest >= rules_.broadcast_gap && rest.count() > 0;
  last_end_ = end;
  if (rest >= rules_.gap) {
    if (size_ > 0) ++stats_.incomplete_packets;
    size_ = 0;
    dropping_ = false;
  }
  if (rested && broadcast_size_ > 0) {
    ++stats_.incomplete_packets;
    broadcast_size_ = 0;
  }
  const auto broadcast = feed_broadcast(byte, rested);
  if (broadcast) {
    // feed_packet() may have taken bytes of this 02 packet for a 3E packet or a bad header.
    size_ = 0;
    dropping_ = false;
    return broadcast;
  }
  return feed_packet(byte);
}

/// Collects the bytes after an 02, which may start a packet. The packet reader gets these bytes
/// too, because 02 may also be a byte of something else.
std::optional<Frame> Receiver::feed_broadcast(std::uint8_t byte, bool rested) {
  if (broadcast_size_ == 0 && !(rested && byte == kBroadcastStart)) return std::nullopt;
  if (broadcast_size_ == 0) before_broadcast_ = stats_;
  broadcast_[broadcast_size_++] = byte;
  if (broadcast_size_ < kBroadcastBytes) return std::nullopt;
  broadcast_size_ = 0;
  if (is_good_broadcast(broadcast_)) {
    stats_ = before_broadcast_;
    return broadcast_of(broadcast_);
  }
  ++stats_.bad_data;
  return std::nullopt;
}

std::optional<Frame> Receiver::feed_packet(std::uint8_t byte) {
  if (dropping_ || (size_ == 0 && byte != kPacketStart)) {
    ++stats_.skipped_bytes;
    return std::nullopt;
  }
  buffer_[size_++] = byte;
  const std::span<const std::uint8_t> bytes(buffer_.data(), size_);
  if (size_ == kHeaderBytes) {
    if (!has_good_header(bytes)) {
      ++stats_.bad_headers;
      resync();
      return std::nullopt;
    }
    if (bytes[3] > rules_.max_len || bytes[3] > kMaxLen) {
      ++stats_.too_long;
      resync();
      return std::nullopt;
    }
  }
  if (size_ < kHeaderBytes || size_ < packet_size(bytes)) return std::nullopt;
  size_ = 0;
  if (has_good_data(bytes)) return packet_of(bytes);
  ++stats_.bad_data;
  return std::nullopt;
}

/// Drops an invalid header. With `scan`, keeps the bytes from the next 3E in it, which may start
/// another packet.
void Receiver::resync() {
  dropping_ = !rules_.scan;
  const auto begin = buffer_.begin() + 1;
  const auto end = buffer_.begin() + static_cast<std::ptrdiff_t>(size_);
  const auto start = rules_.scan ? std::find(begin, end, kPacketStart) : end;
  stats_.skipped_bytes += static_cast<std::uint64_t>(start - buffer_.begin());
  size_ = static_cast<std::size_t>(std::copy(start, end, buffer_.begin()) - buffer_.begin());
}

}  // namespace lk::protocol
