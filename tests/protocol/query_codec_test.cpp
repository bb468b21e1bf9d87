// Queries, byte for byte, both directions. The bytes are worked out by hand from the tables of
// docs/reference/protocol.md.

#include <gtest/gtest.h>

#include "tests/protocol/golden.hpp"

namespace lk::protocol {
namespace query_codec_test {

using test::frame;

Command decoded(const Frame& query) {
  return std::get<Query>(decode_query(query, kLegacyFormat)).command;
}

struct Golden {
  const char* text;
  int id;
  Command command;
};

const Golden kGolden[] = {
    {"141#1900000000000000", 1, WriteZeroToRom{}},
    {"141#3000000000000000", 1, ReadPid{}},
    {"142#31006432280A0BFF", 2, WritePidToRam{{100, 50, 40, 10, 11, 255}}},
    {"142#32000102030405FE", 2, WritePidToRom{{1, 2, 3, 4, 5, 254}}},
    {"143#3300000000000000", 3, ReadAcceleration{}},
    {"143#3400000010270000", 3, WriteAccelerationToRam{10000}},  // 10000 = 0x2710
    {"143#3700000000000000", 3, ReadMaxTorque{}},
    {"143#3800000064000000", 3, WriteMaxTorque{100}},
    {"144#8000000000000000", 4, Off{}},
    {"144#8100000000000000", 4, Stop{}},
    {"144#8800000000000000", 4, Run{}},
    {"150#9000000000000000", 16, ReadEncoder{}},
    {"150#910000000000FF3F", 16, WriteOffsetToRom{16383}},  // 16383 = 0x3FFF
    {"150#9200000000000000", 16, ReadMultiTurnAngle{}},
    {"150#9400000000000000", 16, ReadSingleTurnAngle{}},
    {"150#9500000000000000", 16, ClearAngle{}},
    {"160#9A00000000000000", 32, ReadState1{}},
    {"160#9B00000000000000", 32, ClearErrors{}},
    {"160#9C00000000000000", 32, ReadState2{}},
    {"160#9D00000000000000", 32, ReadState3{}},
    {"141#A100000064000000", 1, Torque{1.6}},    // 100 · 16 mA
    {"141#A100000030F80000", 1, Torque{-32.0}},  // −2000 = 0xF830
    {"141#A2000000A0860100", 1, Speed{1000.0}},  // 100000 = 0x0186A0
    {"141#A2000000FFFFFFFF", 1, Speed{-0.01}},
    {"141#A3000000A08C0000", 1, Position1{36000}},  // 0x8CA0
    {"141#A300000060 73FFFF", 1, Position1{-36000}},
    {"141#A400F401A08C0000", 1, Position2{500, 36000}},               // 500 = 0x01F4
    {"141#A501000028230000", 1, Position3{kCounterClockwise, 9000}},  // 9000 = 0x2328
    {"141#A600F4019F8C0000", 1, Position4{kClockwise, 500, 35999}},
    {"141#A7000000F0D8FFFF", 1, Position5{-10000}},  // 0xFFFFD8F0
    {"141#A800FFFF10270000", 1, Position6{65535, 10000}},
    {"280#64009CFF D007 30F8", kMultiDrive, MultiTorque{{1.6, -1.6, 32.0, -32.0}}},
};

TEST(QueryCodec, GoldenBothDirections) { expect_queries(kGolden); }

TEST(QueryCodec, GoldenCoversEveryRow) { expect_every_command(kGolden); }

// Random values in unused bytes change nothing except the bytes that an echo repeats.
TEST(QueryCodec, UnusedBytesAreIgnored) {
  EXPECT_EQ(decoded(frame("141#9A FF FF FF FF FF FF FF")), Command{ReadState1{}});
  EXPECT_EQ(decoded(frame("141#A2 11 E803 A0860100")), Command{Speed{1000.0}});  // an iq limit
  EXPECT_EQ(decoded(frame("141#34 01 0000 10270000")), Command{WriteAccelerationToRam{10000}});
  EXPECT_EQ(decoded(frame("141#91 00 3412 7856 0100")), Command{WriteOffsetToRom{1}});
  EXPECT_EQ(decoded(frame("141#A1 FF FFFF 0000 FFFF")), Command{Torque{0.0}});
  EXPECT_EQ(decoded(frame("141#A5 00 FFFF 2823 FFFF")), Command{(Position3{kClockwise, 9000})});
  EXPECT_EQ(decoded(frame("141#A3 55 1234 01000000")), Command{Position1{1}});
}

TEST(QueryCodec, IqIsClampedToItsRange) {
  const auto iq_A = [](const char* text) { return std::get<Torque>(decoded(frame(text))).iq_A; };
  EXPECT_EQ(iq_A("141#A1000000D1070000"), 32.0);    // 2001
  EXPECT_EQ(iq_A("141#A1000000FF7F0000"), 32.0);    // 32767
  EXPECT_EQ(iq_A("141#A10000000080 0000"), -32.0);  // −32768
  EXPECT_EQ(std::get<MultiTorque>(decoded(frame("280#D107 FF7F 0080 2FF8"))),
            (MultiTorque{{32.0, 32.0, -32.0, -32.0}}));
}

// Invalid targets and directions of 0xA5/0xA6 are decoded: the drive answers and counts them.
TEST(QueryCodec, DecodesInvalidSingleTurnTargets) {
  EXPECT_EQ(decoded(frame("141#A5020000A08C0000")), Command{(Position3{2, 36000})});
  EXPECT_EQ(decoded(frame("141#A6FF0000FFFF0000")), Command{(Position4{255, 0, 65535})});
}

TEST(QueryCodec, EveryIqCommand) {
  expect_clamped<Torque>({"141#A100000000000000", 4, -2000, 2000}, 0.016,
                         [](const Torque& torque) { return torque.iq_A; });
}

// Fields without scale.
TEST(QueryCodec, EverySixteenBitField) {
  expect_unchanged({{"141#9100000000000000", 6},
                    {"141#A400000001000000", 2},
                    {"141#A500000000000000", 4},
                    {"141#A600000000000000", 2},
                    {"141#A600000000000000", 4},
                    {"141#A800000001000000", 2}},
                   false);
}

// 32-bit fields: values of either half, with the other half at its extremes.
TEST(QueryCodec, ThirtyTwoBitFields) {
  for (const char* text :
       {"141#3400000000000000", "141#A200000000000000", "141#A300000000000000",
        "141#A400000000000000", "141#A700000000000000", "141#A800000000000000"}) {
    Frame query = frame(text);
    for (const int other : {0, 0x7FFF, 0x8000, 0xFFFF}) {
      for (const int n : test::sweep(0, 65535, {0x8000})) {
        put_le(query.data, 4, static_cast<std::uint16_t>(n));
        put_le(query.data, 6, static_cast<std::uint16_t>(other));
        ASSERT_EQ(encode_query(1, decoded(query), kLegacyFormat), query);
        put_le(query.data, 4, static_cast<std::uint16_t>(other));
        put_le(query.data, 6, static_cast<std::uint16_t>(n));
        ASSERT_EQ(encode_query(1, decoded(query), kLegacyFormat), query);
      }
    }
  }
}

TEST(QueryCodec, HostSideRoundsAndSaturates) {
  EXPECT_EQ(encode_query(1, Torque{0.0239}, kLegacyFormat), frame("141#A100000001000000"));
  EXPECT_EQ(encode_query(1, Torque{0.0241}, kLegacyFormat), frame("141#A100000002000000"));
  EXPECT_EQ(encode_query(1, Torque{100}, kLegacyFormat), frame("141#A1000000D0070000"));
  EXPECT_EQ(encode_query(1, Speed{0.29}, kLegacyFormat), frame("141#A20000001D000000"));
  EXPECT_EQ(encode_query(1, Speed{1e9}, kLegacyFormat), frame("141#A2000000FFFFFF7F"));
}

Reject reject(const Frame& query) { return std::get<Reject>(decode_query(query, kLegacyFormat)); }

TEST(QueryCodec, RejectsWithTheReason) {
  EXPECT_EQ(reject(frame("140#9A00000000000000")), Reject::kForeignId);  // ID 0
  EXPECT_EQ(reject(frame("161#9A00000000000000")), Reject::kForeignId);  // ID 33
  EXPECT_EQ(reject(frame("281#9A00000000000000")), Reject::kForeignId);
  EXPECT_EQ(reject(frame("000#")), Reject::kForeignId);
  EXPECT_EQ(reject(frame("141#9A000000000000")), Reject::kWrongLength);
  EXPECT_EQ(reject(frame("141#")), Reject::kWrongLength);
  EXPECT_EQ(reject(frame("280#00")), Reject::kWrongLength);
  EXPECT_EQ(reject(frame("141#FF00000000000000")), Reject::kUnknownCommand);
  EXPECT_EQ(reject(frame("00000141#9A00000000000000")), Reject::kExtended);
  EXPECT_EQ(reject(frame("141#R")), Reject::kRemote);
  Frame query = frame("141#9A00000000000000");
  query.kind = FrameKind::kFd;
  EXPECT_EQ(reject(query), Reject::kCanFd);
  query.kind = FrameKind::kError;
  EXPECT_EQ(reject(query), Reject::kErrorFrame);
}

}  // namespace query_codec_test
}  // namespace lk::protocol
