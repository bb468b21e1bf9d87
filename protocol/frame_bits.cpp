#include "protocol/frame_bits.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>

namespace lk::protocol {
namespace {

/// State of CRC and bit stuffing after the bits so far.
struct BitState {
  std::uint32_t crc = 0;
  // The last `run` bits (1 to 4) are equal to `last`, and the next bit may be equal too. Initially
  // the bus is idle, i.e. recessive; a frame starts with a dominant bit.
  bool last = true;
  std::uint32_t run = 1;
  int stuff_bits = 0;
};

constexpr void take(bool bit, BitState& s) {
  // x¹⁵ + x¹⁴ + x¹⁰ + x⁸ + x⁷ + x⁴ + x³ + 1 (Bosch CAN 2.0, 3.1.1)
  const bool feedback = bit != ((s.crc & 0x4000U) != 0);
  s.crc = (s.crc << 1U) & 0x7FFFU;
  if (feedback) {
    s.crc ^= 0x4599U;
  }
  // After five equal bits, the sender inserts an inverse bit, which starts the next run.
  s.run = bit == s.last ? s.run + 1 : 1;
  s.last = bit;
  if (s.run == 5) {
    ++s.stuff_bits;
    s.last = !bit;
    s.run = 1;
  }
}

constexpr BitState take_byte(std::uint32_t byte, BitState s) {
  for (unsigned k = 8; k-- > 0;) {
    take(((byte >> k) & 1U) != 0, s);
  }
  return s;
}

/// Convert `last` and `run` to a number below 8, and back.
constexpr std::uint32_t packed_run(const BitState& s) { return (s.last ? 4U : 0U) + s.run - 1; }
constexpr void unpack_run(std::uint32_t packed, BitState& s) {
  s.last = packed >= 4;
  s.run = packed % 4 + 1;
}

/// Tables that make `take_byte` fast, because every frame on a bus calls it. Index of `crc`: byte
/// XOR the high bits of the old CRC. Indices of `stuffing`: packed run, byte; entry: 8·(stuff bits)
/// + new packed run.
struct ByteTables {
  std::array<std::uint16_t, 256> crc{};
  std::array<std::array<std::uint8_t, 256>, 8> stuffing{};
};
constexpr ByteTables byte_tables() {
  ByteTables tables;
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    tables.crc[byte] = static_cast<std::uint16_t>(take_byte(byte, {}).crc);
    for (std::uint32_t run = 0; run < 8; ++run) {
      BitState s;
      unpack_run(run, s);
      s = take_byte(byte, s);
      tables.stuffing[run][byte] =
          static_cast<std::uint8_t>(8U * static_cast<std::uint32_t>(s.stuff_bits) + packed_run(s));
    }
  }
  return tables;
}
constexpr ByteTables kTables = byte_tables();

/// Processes a frame's bits in the order on the wire: updates the CRC and counts stuff bits.
class BitCounter {
 public:
  /// Processes the low `width` bits of `value`, most significant first.
  void field(std::uint32_t value, unsigned width) {
    bits_ += static_cast<int>(width);
    for (; width % 8 != 0; --width) {
      take(((value >> (width - 1)) & 1U) != 0, state_);
    }
    for (; width > 0; width -= 8) {
      byte((value >> (width - 8)) & 0xFFU);
    }
  }

  std::uint32_t crc() const { return state_.crc; }
  int bits() const { return bits_; }
  int stuff_bits() const { return state_.stuff_bits; }

 private:
  void byte(std::uint32_t value) {
    state_.crc = ((state_.crc << 8U) & 0x7FFFU) ^ kTables.crc[(state_.crc >> 7U) ^ value];
    const std::uint32_t stuffing = kTables.stuffing[packed_run(state_)][value];
    state_.stuff_bits += static_cast<int>(stuffing / 8);
    unpack_run(stuffing % 8, state_);
  }

  BitState state_;
  int bits_ = 0;
};

/// Processes the bits from start of frame to the end of data.
BitCounter head(const Frame& frame) {
  assert(frame.kind == FrameKind::kData || frame.kind == FrameKind::kRemote);
  const bool remote = frame.kind == FrameKind::kRemote;
  BitCounter counter;
  const std::uint32_t remote_request = remote ? 1 : 0;
  const std::uint32_t dlc = frame.dlc & 0xFU;
  if (frame.extended) {
    // start of frame (0), base identifier (11), substitute remote request 1, extension 1
    counter.field((frame.id >> 18U & 0x7FFU) << 2U | 0b11U, 14);
    // the rest of the identifier (18), remote request, reserved bits r1 and r0, DLC (4)
    counter.field((frame.id & 0x3FFFFU) << 7U | remote_request << 6U | dlc, 25);
  } else {
    // start of frame (0), identifier (11), remote request, extension 0, reserved bit r0, DLC (4)
    counter.field((frame.id & 0x7FFU) << 7U | remote_request << 6U | dlc, 19);
  }
  const std::size_t bytes = remote ? 0 : std::min<std::size_t>(frame.dlc, kCanBytes);
  for (std::size_t k = 0; k < bytes; ++k) {
    counter.field(frame.data[k], 8);
  }
  return counter;
}

}  // namespace

std::uint16_t frame_crc(const Frame& frame) {
  return static_cast<std::uint16_t>(head(frame).crc());
}

int frame_bits(const Frame& frame) {
  BitCounter counter = head(frame);
  counter.field(counter.crc(), 15);
  constexpr int kTail = 1 + 1 + 1 + 7;  // CRC delimiter, ACK slot and delimiter, end: not stuffed
  return counter.bits() + counter.stuff_bits() + kTail;
}

std::uint32_t arbitration_field(const Frame& frame) {
  const std::uint32_t remote = frame.kind == FrameKind::kRemote ? 1 : 0;
  if (!frame.extended) {
    // identifier (11), remote request, identifier extension 0
    return (frame.id & 0x7FFU) << 21U | remote << 20U;
  }
  // base identifier (11), substitute remote request 1, identifier extension 1, rest (18), remote
  // request
  return (frame.id >> 18U & 0x7FFU) << 21U | 0b11U << 19U | (frame.id & 0x3FFFFU) << 1U | remote;
}

}  // namespace lk::protocol
