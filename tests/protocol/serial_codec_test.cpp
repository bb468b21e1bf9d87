// RS-485 packets, byte for byte, both directions: from a real drive's log, printed by the vendor,
// or worked out by hand from docs/reference/rs485.md.

#include <gtest/gtest.h>

#include <optional>

#include "tests/protocol/golden.hpp"

namespace lk::protocol {
namespace serial_codec_test {

using test::bytes;
using test::hex;
using test::packet;

constexpr WireFormat kM23 = wire_format(kM23Dialect, Series::kMf);
constexpr WireFormat kM35 = wire_format(kM35Dialect, Series::kMf);
constexpr WireFormat kM36 = wire_format(kM36Dialect, Series::kMf);
constexpr WireFormat kM36b = wire_format(kM36bDialect, Series::kMf);
constexpr WireFormat kMs35 = wire_format(kM35Dialect, Series::kMs);
constexpr double kMfLsb_A = 33.0 / 4096;

struct GoldenQuery {
  const char* text;
  const WireFormat& format;
  Command command;
  int id = 1;
};

const GoldenQuery kQueries[] = {
    {"3E 07 01 00 46", kM36b, Restart{}},
    {"3E 18 01 00 57", kM36b, Calibrate{}},
    {"3E 37 01 00 76", kM23, ReadMaxTorque{}},
    {"3E 38 01 04 7B 64 00 00 00 64", kM23, WriteMaxTorque{100}},
    // A real MS4015 (log of its host).
    {"3E 12 01 00 51", kMs35, ReadProduct{}},
    {"3E 88 01 00 C7", kMs35, Run{}},
    {"3E 90 01 00 CF", kMs35, ReadEncoder{}},
    {"3E 42 01 07 88 97 32 00 14 00 00 00 DD", kMs35,
     WriteSettingToRam{{SettingId::kSpeedGains, {50, 20, 0}, 0}}},
    {"3E 42 01 07 88 96 32 00 14 00 00 00 DC", kMs35,
     WriteSettingToRam{{SettingId::kAngleGains, {50, 20, 0}, 0}}},
    {"3E A4 01 0C EF B7 47 00 00 00 00 00 00 00 00 00 00 FE", kMs35, Position2{0, 18359}},
    {"3E A4 01 0C EF 6B 48 00 00 00 00 00 00 00 00 00 00 B3", kMs35, Position2{0, 18539}},
    // Printed by the vendor.
    {"3E 19 01 00 58", kM35, WriteZeroToRom{}},
    {"3E 80 01 00 BF", kM35, Off{}},
    {"3E 81 01 00 C0", kM35, Stop{}},
    {"02 80 64 00 00 00 9C FF 00 00 81", kM35, MultiTorque{{100 * kMfLsb_A, 0, -100 * kMfLsb_A, 0}},
     kMultiDrive},
    {"02 81 00 00 68 01 00 00 30 FD 19", kM35, MultiSpeed{{0, 360, 0, -720}}, kMultiDrive},
    {"02 82 50 46 00 00 00 00 D8 DC CE", kM35, MultiPosition{{18000, 0, 0, -9000}}, kMultiDrive},
    // 02 + 88 + 9C + 81 = 1A7; the vendor prints CF.
    {"02 88 9C 00 00 00 00 00 81 00 A7", kM35, MultiCommand{{0x9C, 0, 0, 0x81}}, kMultiDrive},
    // By hand.
    {"3E 9A 01 00 D9", kM35, ReadState1{}},
    {"3E 9B 01 00 DA", kM35, ClearErrors{}},
    {"3E 9C 01 00 DB", kM35, ReadState2{}},
    {"3E 9D 01 00 DC", kM35, ReadState3{}},
    {"3E A0 01 02 E1 52 03 55", kMs35, OpenLoop{850}},  // 0x0352
    {"3E A1 01 02 E2 64 00 64", kM36, Torque{100 * kMfLsb_A}},
    {"3E A2 01 04 E5 A0 8C 00 00 2C", kM36, Speed{360, 0}},
    {"3E A2 01 06 E7 A0 8C 00 00 F4 01 21", kM36, Speed{360, 500 * kMfLsb_A}},
    {"3E A3 01 08 EA 50 46 00 00 00 00 00 00 96", kM36, Position1{18000}},
    {"3E A3 01 08 EA 84 FC FF FF FF FF FF FF 7A", kM36, Position1{-892}},
    {"3E A4 01 0C EF 50 46 00 00 00 00 00 00 A0 8C 00 00 C2", kM36, Position2{360, 18000}},
    {"3E A5 01 04 E8 01 28 23 00 4C", kM36, Position3{kCounterClockwise, 9000}},
    {"3E A5 01 04 E8 01 28 23 00 4C", kM23, Position3{kCounterClockwise, 9000}},
    {"3E A6 01 08 ED 00 28 23 00 A0 8C 00 00 77", kM36, Position4{kClockwise, 360, 9000}},
    {"3E A7 01 04 EA D8 DC FF FF B2", kM36, Position5{-9000}},
    {"3E A8 01 08 EF D8 DC FF FF A0 8C 00 00 DE", kM36, Position6{360, -9000}},
    {"3E 8C 01 01 CC 10 10", kM36, Brake{kBrakeRead}},
    {"3E 90 01 07 D6 01 00 00 00 00 00 00 01", kM36, ReadEncoder{kEncoderRaw}},
    {"3E 92 01 00 D1", kM36, ReadMultiTurnAngle{}},
    {"3E 93 01 00 D2", kM35, ClearTurns{}},
    {"3E 94 01 00 D3", kM36, ReadSingleTurnAngle{}},
    {"3E 95 01 07 DB (8 x 00)", kM36, ClearAngle{0}},
    {"3E 95 01 00 D4", kM35, ClearAngle{0}},
    {"3E C0 01 07 06 0A 00 00 00 00 00 00 0A", kM36, ReadParameter{ParameterId::kAngleGains}},
    {"3E C1 01 07 07 1E 00 00 E8 03 00 00 09", kM36,
     WriteParameter{{ParameterId::kMaxTorqueCurrent, {}, 1000}}},
    {"3E 30 01 00 6F", kM23, ReadPid{}},
    {"3E 31 01 06 76 64 64 32 28 32 32 86", kM23, WritePidToRam{{100, 100, 50, 40, 50, 50}}},
    {"3E 32 01 06 77 64 64 32 28 32 32 86", kM23, WritePidToRom{{100, 100, 50, 40, 50, 50}}},
    {"3E 33 01 00 72", kM23, ReadAcceleration{}},
    {"3E 34 01 04 77 B8 0B 00 00 C3", kM23, WriteAccelerationToRam{3000}},
    {"3E 91 01 02 D2 DC 04 E0", kM23, WriteOffsetToRom{1244}},
    {"3E 40 01 02 81 96 00 96", kM35, ReadSetting{SettingId::kAngleGains}},
    {"3E 44 01 07 8A 9A 40 7E 05 00 00 00 5D", kM35,
     WriteSettingToRom{{SettingId::kMaxSpeed, {}, 360000}}},  // 0x057E40
    {"3E 1F 01 00 5E", kM35, ReadDeviceType{}},
    {"3E 16 01 00 55", kM35, ReadCalibration{}},
    {"3E 14 01 00 53", kM35, ReadSettingsBlock{}},
    {"3E 10 01 00 4F", kM35, Connect{}},
    {"3E 11 01 00 50", kM35, Disconnect{}},
    {"3E 20 01 00 5F", kM35, AlignReducer{}},
    {"3E 48 01 00 87", kM35, RestoreSettings{}},
    {"3E 4A 01 00 89", kM35, RestoreCalibration{}},
};

TEST(SerialCodec, QueriesBothDirections) { expect_queries(kQueries); }

/// Commands with opaque payloads, which have no golden bytes above.
TEST(SerialCodec, QueriesCoverEveryRow) {
  constexpr Opcode kBlocks[] = {WriteSettingsBlock::kOpcode, WriteCalibration::kOpcode,
                                Restore::kOpcode};
  for (const auto& row : serial_commands()) {
    if (std::ranges::find(kBlocks, row.opcode) != std::end(kBlocks)) continue;
    EXPECT_TRUE(std::ranges::any_of(kQueries, [&](const GoldenQuery& golden) {
      return golden.id != kMultiDrive && bytes(golden.text)[1] == static_cast<int>(row.opcode);
    })) << row.name;
  }
}

struct GoldenReply {
  const char* text;
  const WireFormat& format;
  Reply reply;
};

const GoldenReply kReplies[] = {
    {"3E 18 01 07 5E 39 30 00 00 E8 03 01 55", kM36b, Calibrated{12345, 1000, 1}},
    {"3E 19 01 07 5F 00 00 00 A2 00 00 00 A2", kM36b, ZeroWritten{162}},
    {"3E 37 01 04 7A E8 03 00 00 EB", kM23, MaxTorque{1000}},
    // A real MS4015.
    {"3E 90 01 06 D5 25 19 01 1E DC 04 3D", kMs35, Encoder{6437, 7681, 1244}},
    {"3E 90 01 06 D5 66 1A 42 1F DC 04 C1", kMs35, Encoder{6758, 8002, 1244}},
    {"3E 90 01 06 D5 AF 92 8B 97 DC 04 43", kMs35, Encoder{37551, 38795, 1244}},
    {"3E 42 01 02 83 97 00 97", kMs35, SettingWritten{WriteSettingToRam::kOpcode, 0x97, false}},
    {"3E 42 01 02 83 96 00 96", kMs35, SettingWritten{WriteSettingToRam::kOpcode, 0x96, false}},
    {"3E A4 01 07 EA 21 96 00 7C 00 1B 1B 69", kMs35,
     State2{Position2::kOpcode, 33, 0, 124, 6939, 150}},
    {"3E A4 01 07 EA 21 6F 00 79 02 F7 1B 1D", kMs35,
     State2{Position2::kOpcode, 33, 0, 633, 7159, 111}},
    // By hand.
    {"3E 9A 01 07 E0 24 00 E7 01 00 00 00 0C", kM23,
     State1{ReadState1::kOpcode, 36, 48.7, 0, 0, true}},
    {"3E 9A 01 07 E0 24 08 13 00 00 00 00 3F", kM35,
     State1{ReadState1::kOpcode, 36, 48.72, 0, 0, true}},
    {"3E 9B 01 07 E1 24 08 13 64 00 10 01 B4", kM35,
     State1{ClearErrors::kOpcode, 36, 48.72, 1, 1.0, false}},
    {"3E 92 01 08 D9 84 FC FF FF FF FF FF FF 7A", kM35, MultiTurnAngle{-892}},
    {"3E 94 01 04 D7 9F 8C 00 00 2B", kM35, SingleTurnAngle{35999}},  // 0x8C9F
    {"3E 90 01 07 D6 00 00 00 FF FF 03 00 01", kM36,
     Encoder{.type = kEncoderZeroed, .full_counts = 262143}},
    {"3E 8C 01 01 CC 01 01", kM36, BrakeState{true}},
    {"3E C0 01 07 06 0A 64 00 14 00 05 00 87", kM36,
     ParameterValue{{ParameterId::kAngleGains, {100, 20, 5}, 0}}},
    {"3E C1 01 07 07 1E 00 00 E8 03 00 00 09", kM36,
     ParameterValue{{ParameterId::kMaxTorqueCurrent, {}, 1000}, WriteParameter::kOpcode}},
    {"3E 30 01 06 75 64 64 32 28 32 32 86", kM23, Pid{{100, 100, 50, 40, 50, 50}}},
    {"3E 33 01 04 76 B8 0B 00 00 C3", kM23, Acceleration{3000}},
    {"3E 19 01 02 5A DC 04 E0", kM35, ZeroWritten{1244}},
    {"3E 40 01 07 86 97 32 00 14 00 00 00 DD", kM35,
     SettingValue{{SettingId::kSpeedGains, {50, 20, 0}, 0}}},
    {"3E 40 01 07 86 9B 40 7E 05 00 00 00 5E", kM35,
     SettingValue{{SettingId::kMaxAngleLow, {}, 360000}}},
    {"3E 1F 01 02 60 31 20 51", kM35, DeviceType{0x2031}},
    {"3E 10 01 00 4F", kM35, Block{.command = Connect::kOpcode}},
};

TEST(SerialCodec, RepliesBothDirections) { expect_replies(kReplies); }

/// A reply that repeats its query has equal bytes.
TEST(SerialCodec, EchoesRepeatTheirQueries) {
  const char* const texts[] = {"3E 88 01 00 C7", "3E 34 01 04 77 B8 0B 00 00 C3"};
  for (const char* text : texts) {
    const auto query = std::get<Query>(decode_query(packet(text), kM23));
    EXPECT_EQ(hex(encode_reply(1, Echo{query.data, query.size}, kM23)), hex(text));
  }
}

std::optional<Reject> refused(const char* text, const WireFormat& format) {
  const auto result = decode_query(packet(text), format);
  const auto* reject = std::get_if<Reject>(&result);
  return reject != nullptr ? std::optional(*reject) : std::nullopt;
}

/// Real MG4005: 0xC0 requires its seven bytes; 0x30 and 0x33 accept any number.
TEST(SerialCodec, CommandDecidesOnAWrongLength) {
  EXPECT_EQ(refused("3E C0 01 00 FF", kM36), Reject::kWrongLength);
  EXPECT_EQ(refused("3E C0 01 01 00 0A 0A", kM36), Reject::kWrongLength);
  EXPECT_EQ(refused("3E C0 01 02 01 0A 00 0A", kM36), Reject::kWrongLength);
  EXPECT_EQ(refused("3E 30 01 01 70 00 00", kM23), std::nullopt);
  EXPECT_EQ(refused("3E 30 01 07 76 (8 x 00)", kM23), std::nullopt);
  EXPECT_EQ(refused("3E 33 01 04 76 (5 x 00)", kM23), std::nullopt);
  // All other commands depend on lax_length.
  EXPECT_EQ(refused("3E A2 01 02 E3 A0 8C 2C", kM36), Reject::kWrongLength);
  WireFormat lax = kM36;
  lax.dialect.lax_length = true;
  const auto query = std::get<Query>(decode_query(packet("3E A2 01 02 E3 A0 8C 2C"), lax));
  EXPECT_EQ(query.command, Command(Speed{360, 0}));  // missing bytes read as 0
  EXPECT_EQ(refused("3E C0 01 00 FF", lax), Reject::kWrongLength);
  // 0x95 accepts LEN 0 instead of 7, with a bad effect (SerialServo).
  EXPECT_EQ(refused("3E 95 01 00 D4", kM36), std::nullopt);
  EXPECT_EQ(refused("3E 95 01 07 DB (8 x 00)", kM35), Reject::kWrongLength);
  // Only V2.36 has an iq limit.
  EXPECT_EQ(refused("3E A2 01 06 E7 A0 8C 00 00 F4 01 21", kM35), Reject::kWrongLength);
}

/// The oldest manual allows more.
TEST(SerialCodec, ClampsOpenLoopPowerToThePrintedRange) {
  constexpr WireFormat kMs23 = wire_format(kM23Dialect, Series::kMs);
  const auto power = [](const char* text, const WireFormat& format) {
    const auto decoded = decode_query(packet(text), format);
    return std::get<OpenLoop>(std::get<Query>(decoded).command).power_permille;
  };
  EXPECT_EQ(power("3E A0 01 02 E1 E8 03 EB", kMs23), 1000);
  EXPECT_EQ(power("3E A0 01 02 E1 E8 03 EB", kMs35), 850);
  EXPECT_EQ(power("3E A0 01 02 E1 18 FC 14", kMs23), -1000);
}

/// Table of generations in docs/reference/rs485.md.
TEST(SerialCodec, EachGenerationKnowsItsCommands) {
  struct Case {
    int opcode;
    bool m23, m35, m36, m36b;
  };
  const Case cases[] = {{0x30, true, false, false, false}, {0x34, true, false, false, false},
                        {0x37, true, false, false, false}, {0x38, true, false, false, false},
                        {0x91, true, false, false, false}, {0x40, false, true, false, false},
                        {0x42, false, true, false, false}, {0x44, false, true, false, false},
                        {0xC0, false, false, true, true},  {0xC1, false, false, true, true},
                        {0x93, false, true, false, false}, {0x95, false, true, true, true},
                        {0x8C, false, true, true, true},   {0x12, true, true, true, true},
                        {0x9A, true, true, true, true},    {0x07, false, false, false, true},
                        {0x18, false, false, false, true}, {0x89, false, false, false, false},
                        {0xBB, false, false, false, false}};
  for (const Case& one : cases) {
    const auto opcode = static_cast<Opcode>(one.opcode);
    EXPECT_EQ(answers(kM23, opcode), one.m23) << one.opcode;
    EXPECT_EQ(answers(kM35, opcode), one.m35) << one.opcode;
    EXPECT_EQ(answers(kM36, opcode), one.m36) << one.opcode;
    EXPECT_EQ(answers(kM36b, opcode), one.m36b) << one.opcode;
  }
  EXPECT_TRUE(answers(kMs35, OpenLoop::kOpcode));
  EXPECT_FALSE(answers(kMs35, Torque::kOpcode));
  EXPECT_FALSE(answers(kMs35, ReadState3::kOpcode));
}

/// V2.35 documents 0x91 for CAN only, and 0x8C for RS-485 only.
TEST(SerialCodec, KnownCommandsDependOnTheWire) {
  const auto* const v235 = std::ranges::find(kGenerationRows, "v235", &GenerationRow::name);
  const WireFormat can = wire_format(v235->dialect, Series::kMf);
  const WireFormat serial = wire_format(v235->serial, Series::kMf);
  EXPECT_TRUE(answers(can, WriteOffsetToRom::kOpcode));
  EXPECT_FALSE(answers(serial, WriteOffsetToRom::kOpcode));
  EXPECT_FALSE(answers(can, Brake::kOpcode));
  EXPECT_TRUE(answers(serial, Brake::kOpcode));
}

/// 0x280 is in the tables of both wires, at different indices.
TEST(SerialCodec, RejectsFramesOfTheOtherWire) {
  Frame can;
  for (const std::uint32_t id : {0x141U, 0x280U, 0x281U, 0x282U, 0x288U}) {
    can.id = id;
    can.data[0] = 0x9A;
    EXPECT_EQ(std::get<Reject>(decode_query(can, kM35)), Reject::kNoPacket) << id;
  }
  can.id = 0x141;
  EXPECT_EQ(std::get<Reject>(decode_reply(can, kM35)), Reject::kNoPacket);
  for (const char* const text : {"02 80 64 00 00 00 9C FF 00 00 81", "3E 9A 01 00 D9",
                                 "3E 12 01 00 51", "3E 9A 01 07 E0 24 08 13 00 00 00 00 3F"}) {
    EXPECT_EQ(std::get<Reject>(decode_query(packet(text), kLegacyFormat)), Reject::kNoPacket);
  }
  EXPECT_EQ(std::get<Reject>(decode_reply(packet("3E 9A 01 00 D9"), kLegacyFormat)),
            Reject::kNoPacket);
}

TEST(SerialCodec, RejectsIdsOutOfRange) {
  EXPECT_EQ(std::get<int>(address(packet("3E 9A 01 00 D9"))), 1);
  EXPECT_EQ(std::get<int>(address(packet("3E 9A 20 00 F8"))), 32);
  EXPECT_EQ(std::get<Reject>(address(packet("3E 9A 00 00 D8"))), Reject::kForeignId);
  EXPECT_EQ(std::get<Reject>(address(packet("3E 9A 21 00 F9"))), Reject::kForeignId);
  EXPECT_EQ(std::get<Reject>(address(packet("3E 9A FF 00 D7"))), Reject::kForeignId);
}

}  // namespace serial_codec_test
}  // namespace lk::protocol
