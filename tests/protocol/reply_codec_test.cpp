// Replies, byte for byte, both directions. The bytes are worked out by hand from the tables of
// docs/reference/protocol.md.

#include <gtest/gtest.h>

#include "tests/protocol/golden.hpp"

namespace lk::protocol {
namespace reply_codec_test {

using test::frame;

Reply decoded(const Frame& reply) {
  return std::get<ReplyFrame>(decode_reply(reply, kLegacyFormat)).reply;
}

struct Golden {
  const char* text;
  int id;
  Reply reply;
};

constexpr double kIq_A = 33.0 / 2048;  // one LSB

State2 state_2(Opcode command) { return {command, 35, 100 * kIq_A, -500, 0x1234}; }

const Golden kGolden[] = {
    {"141#1900000000003412", 1, ZeroWritten{0x1234}},
    {"141#3000643228141E0A", 1, Pid{{100, 50, 40, 20, 30, 10}}},
    {"142#3107060504030201", 2, Echo{{0x31, 7, 6, 5, 4, 3, 2, 1}}},
    {"142#32AA060504030201", 2, Echo{{0x32, 0xAA, 6, 5, 4, 3, 2, 1}}},
    {"143#33000000F0D8FFFF", 3, Acceleration{-10000}},
    {"143#3401020310270000", 3, Echo{{0x34, 1, 2, 3, 0x10, 0x27, 0, 0}}},
    {"143#37000000E8030000", 3, MaxTorque{1000}},
    {"143#3801020364000000", 3, Echo{{0x38, 1, 2, 3, 0x64, 0, 0, 0}}},
    {"144#8011223344556677", 4, Echo{{0x80, 0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77}}},
    {"144#8100000000000000", 4, Echo{{0x81}}},
    {"144#8800000000000000", 4, Echo{{0x88}}},
    {"150#9000E803F83FF037", 16, Encoder{1000, 0x3FF8, 0x37F0}},  // 1000 = 0x03E8
    {"150#9101020304050607", 16, Echo{{0x91, 1, 2, 3, 4, 5, 6, 7}}},
    {"150#92A08C0000000000", 16, MultiTurnAngle{36000}},
    {"150#92FFFFFFFFFFFFFF", 16, MultiTurnAngle{-1}},
    {"150#9400000000009F8C", 16, SingleTurnAngle{35999}},
    {"150#9500000000000000", 16, Echo{{0x95}}},
    {"160#9A2800F0000000 09", 32, State1{ReadState1::kOpcode, 40, 24.0, 0x09}},  // 240 = 0xF0
    {"160#9BF6003202000000", 32, State1{ClearErrors::kOpcode, -10, 56.2, 0}},    // 562 = 0x0232
    {"160#9C2364000CFE3412", 32, state_2(ReadState2::kOpcode)},       // 100 = 0x64, −500 = 0xFE0C
    {"160#9D23C0004CFFF4FF", 32, State3{35, 3.0, -2.8125, -0.1875}},  // 192, −180, −12 of 1/64 A
    {"160#A12364000CFE3412", 32, state_2(Torque::kOpcode)},
    {"160#A22364000CFE3412", 32, state_2(Speed::kOpcode)},
    {"160#A32364000CFE3412", 32, state_2(Position1::kOpcode)},
    {"160#A42364000CFE3412", 32, state_2(Position2::kOpcode)},
    {"160#A52364000CFE3412", 32, state_2(Position3::kOpcode)},
    {"160#A62364000CFE3412", 32, state_2(Position4::kOpcode)},
    {"160#A72364000CFE3412", 32, state_2(Position5::kOpcode)},
    {"160#A82364000CFE3412", 32, state_2(Position6::kOpcode)},
};

TEST(ReplyCodec, GoldenBothDirections) { expect_replies(kGolden); }

TEST(ReplyCodec, GoldenCoversEveryRow) { expect_every_command(kGolden); }

TEST(ReplyCodec, DecodesValues) {
  const auto state1 = std::get<State1>(decoded(frame("141#9BF6003202000009")));
  EXPECT_EQ(state1.command, ClearErrors::kOpcode);
  EXPECT_EQ(state1.temperature_C, -10);
  EXPECT_NEAR(state1.voltage_V, 56.2, 1e-12);
  EXPECT_EQ(state1.errors, 9);
  EXPECT_EQ(decoded(frame("141#9C2364000CFE3412")), Reply{state_2(ReadState2::kOpcode)});
  EXPECT_EQ(decoded(frame("141#9D23C0004CFFF4FF")), (Reply{State3{35, 3.0, -2.8125, -0.1875}}));
  EXPECT_EQ(decoded(frame("141#92FFFFFFFFFFFFFF")), Reply{MultiTurnAngle{-1}});
}

TEST(ReplyCodec, RoundsAndSaturates) {
  const auto bytes = [](const Reply& reply) { return encode_reply(1, reply, kLegacyFormat); };
  State2 state{.command = ReadState2::kOpcode};
  state.iq_A = 1.49 * kIq_A;
  state.speed_dps = -0.6;
  state.temperature_C = 25.5;
  EXPECT_EQ(bytes(state), frame("141#9C1A0100FFFF0000"));
  state.iq_A = 40;          // clamped to 2048, the end of the ±33 A scale
  state.speed_dps = 72000;  // a max-speed setting beyond int16
  state.temperature_C = 200;
  EXPECT_EQ(bytes(state), frame("141#9C7F0008FF7F0000"));
  state.iq_A = -40;
  state.speed_dps = -72000;
  EXPECT_EQ(bytes(state), frame("141#9C7F00F800800000"));
  EXPECT_EQ(bytes(State1{ReadState1::kOpcode, 0, 7000, 0}), frame("141#9A0000FFFF000000"));
  EXPECT_EQ(bytes(State1{ReadState1::kOpcode, 0, -1, 0}), frame("141#9A00000000000000"));
  EXPECT_EQ(bytes(State3{0, 600, -600, 0}), frame("141#9D00FF7F00800000"));
  EXPECT_EQ(bytes(MultiTurnAngle{kInt56Max + 1}), frame("141#92FFFFFFFFFFFF7F"));
}

// The iq field has the range ±2048.
TEST(ReplyCodec, EverySixteenBitField) {
  expect_unchanged({{"141#1900000000000000", 6},
                    {"141#9000000000000000", 2},
                    {"141#9000000000000000", 4},
                    {"141#9000000000000000", 6},
                    {"141#9400000000000000", 6},
                    {"141#9A00000000000000", 3},
                    {"141#9B00000000000000", 3},
                    {"141#9C00000000000000", 2, -2048, 2048},
                    {"141#A100000000000000", 2, -2048, 2048},
                    {"141#9C00000000000000", 4, -32768, 32767},
                    {"141#9C00000000000000", 6},
                    {"141#9D00000000000000", 2, -32768, 32767},
                    {"141#9D00000000000000", 4, -32768, 32767},
                    {"141#9D00000000000000", 6, -32768, 32767}},
                   true);
}

TEST(ReplyCodec, EveryTemperature) {
  for (int n = -128; n <= 127; ++n) {
    Frame reply = frame("141#9A00000000000000");
    reply.data[1] = static_cast<std::uint8_t>(n);
    EXPECT_EQ(std::get<State1>(decoded(reply)).temperature_C, n);
    EXPECT_EQ(encode_reply(1, decoded(reply), kLegacyFormat), reply);
  }
}

TEST(ReplyCodec, RejectsWithTheReason) {
  const auto reject = [](const char* text) {
    return std::get<Reject>(decode_reply(frame(text), kLegacyFormat));
  };
  EXPECT_EQ(reject("280#0000000000000000"), Reject::kForeignId);
  EXPECT_EQ(reject("141#0000000000000000"), Reject::kUnknownCommand);
  EXPECT_EQ(reject("141#9A"), Reject::kWrongLength);
}

}  // namespace reply_codec_test
}  // namespace lk::protocol
