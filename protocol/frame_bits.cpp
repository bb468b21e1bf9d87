#include "protocol/frame_bits.hpp"

#include <algorithm>
#include <cassert>
#include <cstddef>

namespace lk::protocol {
namespace {

/// Takes the frame's bits in the order of the wire; keeps the CRC and counts stuff bits.
class BitCounter {
 public:
  /// The low `width` bits of `value`, most significant first.
  void field(std::uint32_t value, int width) {
    for (int k = width - 1; k >= 0; --k) {
      const bool bit = ((value >> static_cast<unsigned>(k)) & 1U) != 0;
      update_crc(bit);
      update_stuffing(bit);
    }
    bits_ += width;
  }

  std::uint32_t crc() const { return crc_; }
  int bits() const { return bits_; }
  int stuff_bits() const { return stuff_bits_; }

 private:
  // x¹⁵ + x¹⁴ + x¹⁰ + x⁸ + x⁷ + x⁴ + x³ + 1 (Bosch CAN 2.0, 3.1.1)
  void update_crc(bool bit) {
    const bool feedback = bit != ((crc_ & 0x4000U) != 0);
    crc_ = (crc_ << 1U) & 0x7FFFU;
    if (feedback) {
      crc_ ^= 0x4599U;
    }
  }

  // After five equal bits the sender inserts one of the other kind, which starts the next run.
  void update_stuffing(bool bit) {
    run_ = bit == last_ ? run_ + 1 : 1;
    last_ = bit;
    if (run_ == 5) {
      ++stuff_bits_;
      last_ = !bit;
      run_ = 1;
    }
  }

  std::uint32_t crc_ = 0;
  int bits_ = 0;
  int stuff_bits_ = 0;
  int run_ = 0;
  bool last_ = true;  // the idle bus is recessive
};

/// Start of frame up to the end of data.
BitCounter head(const Frame& frame) {
  assert(frame.kind == FrameKind::kData || frame.kind == FrameKind::kRemote);
  const bool remote = frame.kind == FrameKind::kRemote;
  BitCounter counter;
  counter.field(0, 1);  // start of frame
  if (frame.extended) {
    counter.field(frame.id >> 18U, 11);
    counter.field(0b11, 2);  // substitute remote request, identifier extension
    counter.field(frame.id, 18);
    counter.field(remote ? 1 : 0, 1);
    counter.field(0, 2);  // reserved bits r1, r0
  } else {
    counter.field(frame.id, 11);
    counter.field(remote ? 1 : 0, 1);
    counter.field(0, 2);  // identifier extension, reserved bit r0
  }
  counter.field(frame.dlc, 4);
  const std::size_t bytes = remote ? 0 : std::min<std::size_t>(frame.dlc, frame.data.size());
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
  constexpr int kTail =
      1 + 1 + 1 + 7;  // CRC delimiter, ACK slot, ACK delimiter, end of frame: never stuffed
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
