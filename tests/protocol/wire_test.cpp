#include "protocol/wire.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include "protocol/rounding.hpp"
#include "tests/support/sweep.hpp"

namespace lk::protocol {
namespace wire_test {

TEST(Wire, LittleEndian) {
  const Payload data{0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88};
  EXPECT_EQ(get_le<std::uint8_t>(data, 7), 0x88);
  EXPECT_EQ(get_le<std::uint16_t>(data, 2), 0x4433);
  EXPECT_EQ(get_le<std::uint32_t>(data, 4), 0x88776655U);
  EXPECT_EQ(get_le<std::int8_t>(data, 7), -120);

  Payload out{};
  put_le(out, 4, std::int32_t{-2});
  EXPECT_EQ(out, (Payload{0, 0, 0, 0, 0xFE, 0xFF, 0xFF, 0xFF}));
  put_le(out, 2, std::uint16_t{0x1234});
  EXPECT_EQ(out, (Payload{0, 0, 0x34, 0x12, 0xFE, 0xFF, 0xFF, 0xFF}));
}

TEST(Wire, SignedFiftySixBits) {
  struct Case {
    std::int64_t value;
    Payload data;
  };
  const Case cases[] = {
      {0, {0x92, 0, 0, 0, 0, 0, 0, 0}},
      {1, {0x92, 1, 0, 0, 0, 0, 0, 0}},
      {-1, {0x92, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}},
      {36000, {0x92, 0xA0, 0x8C, 0, 0, 0, 0, 0}},
      {-36000, {0x92, 0x60, 0x73, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}},
      // Bit 31 is not the sign: a host that reads an int32 gets a negative angle here.
      {2147483648, {0x92, 0, 0, 0, 0x80, 0, 0, 0}},
      {kInt56Max, {0x92, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x7F}},
      {kInt56Min, {0x92, 0, 0, 0, 0, 0, 0, 0x80}},
  };
  for (const auto& c : cases) {
    Payload data{0x92};
    put_le56(data, c.value);
    EXPECT_EQ(data, c.data) << c.value;
    EXPECT_EQ(get_le56(c.data), c.value);
  }
}

TEST(Wire, FiftySixBitsSaturate) {
  Payload data{};
  put_le56(data, kInt56Max + 1);
  EXPECT_EQ(get_le56(data), kInt56Max);
  put_le56(data, std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(get_le56(data), kInt56Min);
}

TEST(Rounding, RoundsHalvesAwayFromZero) {
  EXPECT_EQ(rounded(0.5), 1);
  EXPECT_EQ(rounded(-0.5), -1);
  EXPECT_EQ(rounded(2.5), 3);
  EXPECT_EQ(rounded(0.49999999999999994), 0);  // adding 0.5 gives 1
  EXPECT_EQ(rounded(-0.49999999999999994), 0);
  EXPECT_EQ(rounded(4503599627370497.0), 4503599627370497);  // adding 0.5 gives the even one above
  EXPECT_EQ(rounded(-0x1p62), -(std::int64_t{1} << 62));
}

TEST(Rounding, RoundsDownBelowZero) {
  EXPECT_EQ(rounded_down(0.75), 0);
  EXPECT_EQ(rounded_down(-0.25), -1);
  EXPECT_EQ(rounded_down(-3.0), -3);
  EXPECT_EQ(rounded_down(0x1p62), std::int64_t{1} << 62);
}

TEST(Quantize, RoundsToNearest) {
  EXPECT_EQ(quantize<std::int16_t>(0.29, 0.01), 29);  // truncation gives 28: 0.29/0.01 = 28.999…
  EXPECT_EQ(quantize<std::int16_t>(1.49, 1.0), 1);
  EXPECT_EQ(quantize<std::int16_t>(1.5, 1.0), 2);
  EXPECT_EQ(quantize<std::int16_t>(-1.5, 1.0), -2);
  EXPECT_EQ(quantize<std::int16_t>(-1.49, 1.0), -1);
}

TEST(Quantize, Saturates) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(quantize<std::int16_t>(32767.6, 1.0), 32767);
  EXPECT_EQ(quantize<std::int16_t>(-40000, 1.0), -32768);
  EXPECT_EQ(quantize<std::uint16_t>(-0.6, 1.0), 0);
  EXPECT_EQ(quantize<std::int8_t>(128, 1.0), 127);
  EXPECT_EQ((quantize<std::int16_t>(3000, 1.0, -2048, 2048)), 2048);
  EXPECT_EQ((quantize<std::int16_t>(-3000, 1.0, -2048, 2048)), -2048);
  EXPECT_EQ(quantize<std::int32_t>(kInf, 0.01), std::numeric_limits<std::int32_t>::max());
  EXPECT_EQ(quantize<std::int64_t>(1e300, 1.0), std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(quantize<std::int64_t>(-kInf, 1.0), std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(quantize<std::uint8_t>(std::nan(""), 1.0), 0);
}

// A 16-bit value is unchanged by conversion to a double and back, for all scales in use and two
// others.
TEST(Quantize, KeepsEveryFieldValue) {
  for (const double lsb : {32.0 / 2000, 33.0 / 2048, 1.0 / 64, 0.1, 0.01, 1.0, 66.0 / 4096, 0.3}) {
    for (const int n : test::sweep(-32768, 32767)) {
      ASSERT_EQ(quantize<std::int16_t>(n * lsb, lsb), n) << lsb;
    }
    for (const int n : test::sweep(0, 65535, {0x8000})) {
      ASSERT_EQ(quantize<std::uint16_t>(n * lsb, lsb), n) << lsb;
    }
  }
}

}  // namespace wire_test
}  // namespace lk::protocol
