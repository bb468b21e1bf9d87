// Frame lengths against the bit streams of real frames, worked out by hand.

#include "protocol/frame_bits.hpp"

#include <gtest/gtest.h>

#include <span>

#include "tests/support/frames.hpp"

namespace lk::protocol {
namespace frame_bits_test {

using test::frame;

// Remote frame 0x000 with DLC 0: SOF and 11 identifier bits 0, RTR 1, IDE 0, r0 0, DLC 0000.
//   0 00000000000 1 00 0000
// CRC by long division of 0000000000001000000·x¹⁵, that is x⁶·x¹⁵ = x²¹, by the generator
// x¹⁵+x¹⁴+x¹⁰+x⁸+x⁷+x⁴+x³+1 (0xC599):
//   x¹⁵ ≡ 4599, x¹⁶ ≡ 8B32 ^ C599 = 4EAB, x¹⁷ ≡ 9D56 ^ C599 = 58CF, x¹⁸ ≡ B19E ^ C599 = 7407,
//   x¹⁹ ≡ E80E ^ C599 = 2D97, x²⁰ ≡ 5B2E, x²¹ ≡ B65C ^ C599 = 73C5 = 111001111000101.
TEST(FrameBits, CrcByHand) { EXPECT_EQ(frame_crc(frame("000#R")), 0x73C5); }

// 0 00000000000 1 00 0000 | 111001111000101
// Runs: twelve 0 → a stuff 1 after the 5th and after the 10th, two 0 remain; 1; six 0 → one after
// the 5th (the sixth 0 follows); 111; 00; 1111; 000; 1; 0; 1: no more. 19 + 15 + 3 + 10 = 47.
TEST(FrameBits, RemoteFrameByHand) { EXPECT_EQ(frame_bits(frame("000#R")), 47); }

// An extended frame has 20 more header bits: 11 + SRR + IDE + 18 + RTR + r1 + r0 instead of 11 +
// RTR + IDE + r0.
TEST(FrameBits, ExtendedFrameLength) {
  // Identifier 0x0AAAAAAA and data 55 are alternating bits, so only control field and CRC may need
  // stuffing.
  const int standard = frame_bits(frame("2AA#55"));
  const int extended = frame_bits(frame("0AAAAAAA#55"));
  EXPECT_GE(standard, 44 + 8);
  EXPECT_LE(standard, 44 + 8 + 6);
  EXPECT_GE(extended, 64 + 8);
  EXPECT_LE(extended, 64 + 8 + 6);
}

/// Returns the stuffed frame as text of bits. Independent of the code under test: polynomial
/// division on plain text.
std::string stuffed_stream(const Frame& f) {
  const auto bits_of = [](std::uint32_t value, int width) {
    std::string text;
    for (int k = width - 1; k >= 0; --k) text += ((value >> k) & 1U) != 0 ? '1' : '0';
    return text;
  };
  std::string stream = "0" + bits_of(f.id, 11) + "000" + bits_of(f.dlc, 4);
  for (int k = 0; k < f.dlc; ++k) stream += bits_of(f.data[static_cast<std::size_t>(k)], 8);

  std::string rest = stream + std::string(15, '0');
  const std::string generator = "1100010110011001";
  for (std::size_t k = 0; k + 15 < rest.size(); ++k) {
    if (rest[k] == '0') continue;
    for (std::size_t j = 0; j < generator.size(); ++j) {
      rest[k + j] = rest[k + j] == generator[j] ? '0' : '1';
    }
  }
  stream += rest.substr(rest.size() - 15);

  std::string out;
  for (const char bit : stream) {
    out += bit;
    if (out.size() >= 5 && out.substr(out.size() - 5) == std::string(5, bit)) {
      out += bit == '0' ? '1' : '0';
    }
  }
  return out;
}

TEST(FrameBits, CountsTheBitsOfTheStuffedStream) {
  for (const char* text :
       {"141#9A00000000000000", "141#9C2364000CFE3412", "160#FFFFFFFFFFFFFFFF",
        "280#0000000000000000", "280#64009CFFD00730F8", "7FF#", "000#", "155#5555"}) {
    EXPECT_EQ(frame_bits(frame(text)), static_cast<int>(stuffed_stream(frame(text)).size()) + 10)
        << text;
  }
  std::uint64_t state = 1;
  for (int n = 0; n < 3000; ++n) {
    Frame f = frame("000#0000000000000000");
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    f.id = static_cast<std::uint32_t>(state >> 53U);
    f.dlc = static_cast<std::uint8_t>((state >> 40U) % 9);
    for (auto& byte : std::span(f.data).first(kCanBytes)) {
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      byte = static_cast<std::uint8_t>(state >> 33U);
      if ((state >> 60U) < 10) byte = (state >> 62U) == 0 ? 0x00 : 0xFF;  // makes long runs
    }
    ASSERT_EQ(frame_bits(f), static_cast<int>(stuffed_stream(f).size()) + 10);
    ASSERT_GE(frame_bits(f), 44 + 8 * f.dlc);
    ASSERT_LE(frame_bits(f), 44 + 8 * f.dlc + (33 + 8 * f.dlc) / 4);
  }
}

}  // namespace frame_bits_test
}  // namespace lk::protocol
