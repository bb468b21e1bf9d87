#include "emulator/transports/cannelloni.hpp"

#include <algorithm>

namespace lk::emulator {
namespace {

using protocol::Frame;
using protocol::FrameKind;

constexpr std::uint8_t kVersion = 2;
constexpr std::uint8_t kDataCode = 0;  // of the op codes; the others are of no use
constexpr std::size_t kHeaderBytes = 5;
constexpr std::size_t kFrameBytes = 5;  // identifier and length
// Flags of an identifier, as in linux/can.h, which not every system has.
constexpr std::uint32_t kExtendedFlag = 0x80000000U;
constexpr std::uint32_t kRemoteFlag = 0x40000000U;
constexpr std::uint32_t kErrorFlag = 0x20000000U;
// Of a length: CAN FD, and a byte of flags follows.
constexpr std::uint8_t kFdFlag = 0x80;
constexpr std::size_t kMostFdBytes = 64;

std::uint32_t big_endian(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8U | byte;
  return value;
}

FrameKind kind_of(std::uint32_t id, bool fd) {
  if ((id & kErrorFlag) != 0) return FrameKind::kError;
  if (fd) return FrameKind::kFd;
  return (id & kRemoteFlag) != 0 ? FrameKind::kRemote : FrameKind::kData;
}

/// The frame that `rest` begins with, which is taken off it.
std::optional<Frame> take_frame(std::span<const std::uint8_t>& rest) {
  if (rest.size() < kFrameBytes) return std::nullopt;
  const std::uint32_t id = big_endian(rest.first(4));
  const bool fd = (rest[4] & kFdFlag) != 0;
  const std::size_t length = rest[4] & 0x7FU;
  const std::size_t header = kFrameBytes + (fd ? 1 : 0);
  const std::size_t data = (id & kRemoteFlag) != 0 ? 0 : length;
  if (length > (fd ? kMostFdBytes : protocol::kCanBytes)) return std::nullopt;
  if (rest.size() < header + data) return std::nullopt;
  Frame frame;
  frame.extended = (id & kExtendedFlag) != 0;
  frame.id = id & protocol::kMostExtendedId;
  frame.kind = kind_of(id, fd);
  if (!frame.extended && frame.id > protocol::kMostStandardId) return std::nullopt;
  const bool plain = frame.kind == FrameKind::kData || frame.kind == FrameKind::kRemote;
  frame.dlc = plain ? static_cast<std::uint8_t>(length) : std::uint8_t{0};
  if (frame.kind == FrameKind::kData) {
    std::ranges::copy(rest.subspan(header, data), frame.data.begin());
  }
  rest = rest.subspan(header + data);
  return frame;
}

void append_frame(const Frame& frame, std::vector<std::uint8_t>& out) {
  const bool remote = frame.kind == FrameKind::kRemote;
  const std::uint32_t id = frame.id | (frame.extended ? kExtendedFlag : 0) |
                           (remote ? kRemoteFlag : 0) |
                           (frame.kind == FrameKind::kError ? kErrorFlag : 0);
  for (const unsigned shift : {24U, 16U, 8U, 0U}) {
    out.push_back(static_cast<std::uint8_t>(id >> shift));
  }
  out.push_back(frame.dlc);
  if (!remote) out.insert(out.end(), frame.data.begin(), frame.data.begin() + frame.dlc);
}

}  // namespace

std::optional<CannelloniPacket> parse_cannelloni(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kHeaderBytes || bytes.size() > kLongestCannelloni) return std::nullopt;
  if (bytes[0] != kVersion || bytes[1] != kDataCode) return std::nullopt;
  CannelloniPacket packet{.sequence = bytes[2], .frames = {}};
  const std::uint32_t count = big_endian(bytes.subspan(3, 2));
  std::span<const std::uint8_t> rest = bytes.subspan(kHeaderBytes);
  for (std::uint32_t n = 0; n < count; ++n) {
    const auto frame = take_frame(rest);
    if (!frame) return std::nullopt;
    packet.frames.push_back(*frame);
  }
  return packet;
}

std::vector<std::uint8_t> cannelloni_packet(std::span<const Frame> frames, std::uint8_t sequence) {
  std::vector<std::uint8_t> out{kVersion, kDataCode, sequence,
                                static_cast<std::uint8_t>(frames.size() >> 8U),
                                static_cast<std::uint8_t>(frames.size())};
  for (const Frame& frame : frames) append_frame(frame, out);
  return out;
}

unsigned PacketsMissed::before(std::uint8_t sequence) {
  const auto step = static_cast<std::uint8_t>(sequence - last_.value_or(sequence) - 1);
  const bool late = last_ && sequence != 0 && step >= 128;
  if (late) return 0;
  const bool first = !last_ || sequence == 0;
  last_ = sequence;
  return first ? 0 : step;
}

}  // namespace lk::emulator
