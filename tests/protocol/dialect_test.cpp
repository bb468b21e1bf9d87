// Wire differences of the generations and series, byte for byte, both directions. The bytes are
// worked out by hand from docs/reference/protocol.md §10.

#include <gtest/gtest.h>

#include <set>
#include <string_view>

#include "tests/protocol/golden.hpp"

namespace lk::protocol {
namespace dialect_test {

using test::frame;

constexpr WireFormat kMgV236b = wire_format(kV236bDialect, Series::kMg);
constexpr WireFormat kMgV236 = wire_format(kV236Dialect, Series::kMg);
constexpr WireFormat kMfV236 = wire_format(kV236Dialect, Series::kMf);
constexpr WireFormat kMfV235 = wire_format(kV235Dialect, Series::kMf);
constexpr WireFormat kMsV236 = wire_format(kV236Dialect, Series::kMs);
constexpr WireFormat kMgLate = wire_format(kLateLegacyDialect, Series::kMg);
constexpr WireFormat kMfLate = wire_format(kLateLegacyDialect, Series::kMf);
constexpr WireFormat kMsLegacy = wire_format(kLegacyDialect, Series::kMs);

constexpr Series kAllOfSeries[] = {Series::kMs, Series::kMf, Series::kMg, Series::kMh};

// --- commands of each dialect

using Bytes = std::set<unsigned>;
const Bytes kOfAll{0x19, 0x80, 0x81, 0x88, 0x90, 0x92, 0x94, 0x95, 0x9A, 0x9B,
                   0x9C, 0x9D, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8};

/// Commands of a drive other than MS: docs/reference/protocol.md §3, §10.1 and §10.4, by hand.
Bytes expected_of(std::string_view generation) {
  Bytes bytes = kOfAll;
  if (generation == "legacy" || generation == "late-legacy") {
    bytes.merge(Bytes{0x30, 0x31, 0x32, 0x33, 0x34, 0x37, 0x38, 0x91});
  } else if (generation == "v235") {
    bytes.merge(Bytes{0x91, 0xA0});
  } else {
    bytes.merge(Bytes{0x8C, 0xA0, 0xC0, 0xC1});
  }
  if (generation == "v236b") bytes.merge(Bytes{0x07, 0x18, 0x40, 0x42, 0x44});
  return bytes;
}

// Covers every byte, every generation, every series.
TEST(Dialect, KnowsOnlyItsCommands) {
  for (const GenerationRow& preset : kGenerationRows) {
    for (const Series series : kAllOfSeries) {
      Bytes expected = expected_of(preset.name);
      for (const unsigned byte : series == Series::kMs ? Bytes{0x9D, 0xA1} : Bytes{0xA0}) {
        expected.erase(byte);
      }
      for (unsigned byte = 0; byte < 256; ++byte) {
        Frame query = frame("141#000A000000000000");  // a parameter of 0xC0 and 0xC1
        if (byte == 0x40 || byte == 0x42) query = frame("141#00050A0001000000");
        if (byte == 0x44) query = frame("141#0005FA0000000000");
        query.data[0] = static_cast<std::uint8_t>(byte);
        const auto result = decode_query(query, wire_format(preset.dialect, series));
        ASSERT_EQ(std::holds_alternative<Query>(result), expected.contains(byte))
            << byte << " generation " << preset.name << " series " << static_cast<int>(series);
      }
    }
  }
}

TEST(Dialect, KnowsOnlyItsMultiDriveIdentifiers) {
  for (const GenerationRow& preset : kGenerationRows) {
    for (const Series series : kAllOfSeries) {
      for (std::uint32_t id = 0x200; id < 0x300; ++id) {
        Frame query;
        query.id = id;
        const bool newest =
            preset.name.starts_with("v236") && (id == 0x281 || id == 0x282 || id == 0x288);
        const bool torque = id == 0x280 && series != Series::kMs;
        const auto result = decode_query(query, wire_format(preset.dialect, series));
        EXPECT_EQ(std::holds_alternative<Query>(result), newest || torque) << id;
      }
    }
  }
}

TEST(Dialect, SwitchesAreIndependent) {
  const auto answered = [](const Dialect& dialect, const char* text) {
    return std::holds_alternative<Query>(
        decode_query(frame(text), wire_format(dialect, Series::kMf)));
  };
  Dialect dialect;
  dialect.brake_command = true;
  EXPECT_TRUE(answered(dialect, "141#8C10000000000000"));
  EXPECT_FALSE(answered(dialect, "141#C00A000000000000"));
  dialect = {};
  dialect.pid_commands = false;
  for (const char* text : {"141#3000000000000000", "141#3100000000000000", "141#3200000000000000",
                           "141#3300000000000000", "141#3400000000000000"}) {
    EXPECT_FALSE(answered(dialect, text));
    EXPECT_TRUE(answered({}, text));
  }
  EXPECT_TRUE(answered(dialect, "141#9100000000000000"));
}

TEST(Dialect, UnknownParametersAreUnknownCommands) {
  for (unsigned id = 0; id < 256; ++id) {
    const bool known =
        std::set<unsigned>{0x0A, 0x0B, 0x0C, 0x1E, 0x20, 0x22, 0x24, 0x26}.contains(id);
    for (const char* text : {"141#C000000000000000", "141#C100000000000000"}) {
      Frame query = frame(text);
      query.data[1] = static_cast<std::uint8_t>(id);
      const auto result = decode_query(query, kMgV236);
      ASSERT_EQ(std::holds_alternative<Query>(result), known) << id;
      if (!known) {
        EXPECT_EQ(std::get<Reject>(result), Reject::kUnknownCommand);
      }
    }
  }
}

// --- bytes

struct GoldenQuery {
  const char* text;
  int id;
  Command command;
};

const GoldenQuery kQueries[] = {
    {"141#8C01000000000000", 1, Brake{kBrakeRelease}},
    {"141#8C10000000000000", 1, Brake{kBrakeRead}},
    {"141#95000000B0040000", 1, ClearAngle{1200}},  // 0x04B0
    {"141#9500000050FBFFFF", 1, ClearAngle{-1200}},
    {"141#A10000000008 0000", 1, Torque{33}},  // 2048 of 66/4096 A
    {"141#A2003E00A0860100", 1, Speed{1000.0, 62 * 66.0 / 4096}},
    {"141#A5010000407E0500", 1, Position3{kCounterClockwise, 360000}},  // 0x057E40
    {"141#A600F401A08C0000", 1, Position4{kClockwise, 500, 36000}},
    {"142#C00A000000000000", 2, ReadParameter{ParameterId::kAngleGains}},
    {"142#C10B640032000100", 2,
     WriteParameter{{ParameterId::kSpeedGains, {.kp = 100, .ki = 50, .kd = 1}, 0}}},
    {"142#C11E0000E8030000", 2, WriteParameter{{ParameterId::kMaxTorqueCurrent, {}, 1000}}},
    {"142#C120000040420F00", 2, WriteParameter{{ParameterId::kMaxSpeed, {}, 1000000}}},
    {"142#C1220000A08C0000", 2, WriteParameter{{ParameterId::kMaxAngle, {}, 36000}}},
    {"142#C1240000A8610000", 2, WriteParameter{{ParameterId::kCurrentRamp, {}, 25000}}},
    {"142#C1260000FFFFFFFF", 2, WriteParameter{{ParameterId::kSpeedRamp, {}, -1}}},
    {"281#0100FFFFFF7F0080", kMultiDrive, MultiSpeed{{1, -1, 32767, -32768}}},
    {"282#0100FFFFFF7F0080", kMultiDrive, MultiPosition{{1, -1, 32767, -32768}}},
    {"282#504600000000D8DC", kMultiDrive, MultiPosition{{18000, 0, 0, -9000}}},  // 180°, −90°
    {"288#9A009C00920000 00", kMultiDrive, MultiCommand{{0x9A, 0x9C, 0x92, 0}}},
};

TEST(Dialect, RejectsRepliesToUnknownCommands) {
  const auto reject = [](const char* text, const WireFormat& format) {
    const auto decoded = decode_reply(frame(text), format);
    const auto* reason = std::get_if<Reject>(&decoded);
    return reason != nullptr ? std::optional(*reason) : std::nullopt;
  };
  const char* const torque = "141#A12364000CFE3412";
  EXPECT_EQ(reject(torque, kMsV236), Reject::kUnknownCommand);
  EXPECT_EQ(reject(torque, kMgV236), std::nullopt);
  const char* const pid = "141#3000643228141E0A";
  EXPECT_EQ(reject(pid, kMgV236), Reject::kUnknownCommand);
  EXPECT_EQ(reject(pid, kLegacyFormat), std::nullopt);
  EXPECT_EQ(reject("141#C0FF000000000000", kMgV236), Reject::kUnknownCommand);
  EXPECT_EQ(reject("141#C00A000000000000", kMgV236), std::nullopt);
}

TEST(Dialect, NoDriveKnowsCommandsOutsideTheTables) {
  for (const WireFormat& format : {kLegacyFormat, kMgV236, kMsV236}) {
    for (unsigned byte = 0; byte < 256; ++byte) {
      const auto opcode = static_cast<std::uint8_t>(byte);
      if (find_command(opcode) == nullptr) {
        EXPECT_FALSE(answers(format, static_cast<Opcode>(opcode))) << byte;
      }
    }
    for (const std::uint32_t id : {0x141U, 0x27FU, 0x283U, 0x289U, 0x7FFU}) {
      EXPECT_FALSE(knows_multi_drive(format, id)) << id;
    }
  }
}

TEST(Dialect, GoldenQueriesBothDirections) { expect_queries(kQueries, kMgV236); }

/// Commands that the first print lacks.
const GoldenQuery kSecondPrint[] = {
    {"147#40050A0000000000", 7, ReadStoredSetting{{5, 0x0A, {}, 0}}},
    {"147#40A0000000000000", 7, ReadStoredSetting{{0xA0, 0, {}, 0}}},
    {"147#42050D0003000000", 7, WriteStoredSetting{{5, 0x0D, {}, 3}}},
    {"147#4205E200407E0500", 7, WriteStoredSetting{{5, 0xE2, {}, 360000}}},
    {"147#42A0640014000500", 7, WriteStoredSetting{{0xA0, 0, {100, 20, 5}, 0}}},
    {"147#4405FA0000000000", 7, SaveSettings{}},
    {"147#0700000000000000", 7, Restart{}},
    {"147#1800000000000000", 7, Calibrate{}},
};

TEST(Dialect, OnlyTheSecondPrintHasItsQueries) {
  expect_queries(kSecondPrint, kMgV236b);
  for (const GoldenQuery& golden : kSecondPrint) {
    const auto first = decode_query(frame(golden.text), kMgV236);
    EXPECT_EQ(std::get<Reject>(first), Reject::kUnknownCommand) << golden.text;
  }
}

struct GoldenReply {
  const char* text;
  WireFormat format;
  Reply reply;
};

constexpr double kMfLsb_A = 33.0 / 4096;

const GoldenReply kReplies[] = {
    // Captured from real drives, an MG6010E-i6 and an MG4005-i10, v236 and later.
    {"141#9A24081300000000", kMgV236, State1{ReadState1::kOpcode, 36, 48.72, 0}},
    {"141#9A1F540900000000", kMgV236, State1{ReadState1::kOpcode, 31, 23.88, 0}},
    {"141#9A240813000000 09", kMfV235, State1{ReadState1::kOpcode, 36, 48.72, 9}},
    {"141#9BF60813850010 81", kMgV236, State1{ClearErrors::kOpcode, -10, 48.72, 0x81, 1.33, false}},
    {"141#9AF608137BFF00 00", kMgV236, State1{ReadState1::kOpcode, -10, 48.72, 0, -1.33}},
    {"141#8C01000000000000", kMgV236, BrakeState{true}},
    {"141#8C00000000000000", kMgV236, BrakeState{false}},
    {"141#940000003F7E0500", kMgV236, SingleTurnAngle{359999}},
    {"141#9C2364000CFE3412", kMfV236,
     State2{ReadState2::kOpcode, 35, 100 * kMfLsb_A, -500, 0x1234}},
    {"141#9C2364000CFE3412", kMgV236,
     State2{ReadState2::kOpcode, 35, 200 * kMfLsb_A, -500, 0x1234}},
    {"141#A02318FC0CFE3412", kMsV236, State2{OpenLoop::kOpcode, 35, 0, -500, 0x1234, -1000}},
    {"141#9C23FA000CFE3412", kMsLegacy, State2{ReadState2::kOpcode, 35, 0, -500, 0x1234, 250}},
    {"141#9D23 C000 4CFF F4FF", kMfV236,
     State3{35, 192 * kMfLsb_A, -180 * kMfLsb_A, -12 * kMfLsb_A}},
    {"141#9D23 C000 4CFF F4FF", kMfV235, State3{35, 3.0, -2.8125, -0.1875}},  // 1/64 A
    // late-legacy: state as in the manual, wide angle, current scale of the series
    {"141#9A2400E701000000", kMgLate, State1{ReadState1::kOpcode, 36, 48.7, 0}},
    {"141#9B1900F000000009", kMfLate, State1{ClearErrors::kOpcode, 25, 24.0, 9}},
    {"141#94000000D6590000", kMfLate, SingleTurnAngle{22998}},
    {"141#940000003F7E0500", kMgLate, SingleTurnAngle{359999}},
    {"141#9C2364000CFE3412", kMfLate,
     State2{ReadState2::kOpcode, 35, 100 * kMfLsb_A, -500, 0x1234}},
    {"141#A22364000CFE3412", kMgLate, State2{Speed::kOpcode, 35, 200 * kMfLsb_A, -500, 0x1234}},
    {"141#9D23 C000 4CFF F4FF", kMgLate, State3{35, 3.0, -2.8125, -0.1875}},  // 1/64 A
    {"141#9200 8000 0000 0000", kMgLate, MultiTurnAngle{0x8000}},
    {"141#3000 6432 2814 1E0A", kMfLate, Pid{{100, 50, 40, 20, 30, 10}}},
    {"141#C00C0100020003FF", kMgV236,
     ParameterValue{{ParameterId::kCurrentGains, {.kp = 1, .ki = 2, .kd = 0xFF03}, 0}}},
    {"141#C01E0000E8030000", kMgV236, ParameterValue{{ParameterId::kMaxTorqueCurrent, {}, 1000}}},
    {"141#C0200000A0A21900", kMgV236, ParameterValue{{ParameterId::kMaxSpeed, {}, 1680032}}},
    {"141#C11E0000E8030000", kMgV236,
     ParameterValue{{ParameterId::kMaxTorqueCurrent, {}, 1000}, WriteParameter::kOpcode}},
    // additions of the second print of V2.36
    {"141#40050A0007000000", kMgV236b, StoredSettingValue{{5, 0x0A, {}, 7}}},
    {"141#42A0640014000500", kMgV236b,
     StoredSettingValue{{0xA0, 0, {100, 20, 5}, 0}, WriteStoredSetting::kOpcode}},
    {"141#4205E200407E0500", kMgV236b,
     StoredSettingValue{{5, 0xE2, {}, 360000}, WriteStoredSetting::kOpcode}},
    {"141#4405010000000000", kMgV236b, SettingsSaved{5, true}},
    {"141#4405000000000000", kMgV236b, SettingsSaved{5, false}},
    {"141#18393000 00E803 01", kMgV236b, Calibrated{12345, 1000, 1}},
    {"141#19000000A2000000", kMgV236b, ZeroWritten{162}},
    {"141#190000000000A200", kMgV236, ZeroWritten{162}},
};

TEST(Dialect, GoldenRepliesBothDirections) { expect_replies(kReplies); }

TEST(Dialect, DecodesValues) {
  const auto state_1 = std::get<State1>(
      std::get<ReplyFrame>(decode_reply(frame("141#9BF6081385001081"), kMgV236)).reply);
  EXPECT_NEAR(state_1.voltage_V, 48.72, 1e-12);
  EXPECT_NEAR(state_1.bus_current_A, 1.33, 1e-12);
  EXPECT_FALSE(state_1.bridge_on);
  const auto state_2 = std::get<State2>(
      std::get<ReplyFrame>(decode_reply(frame("141#9C2318FC0CFE3412"), kMsV236)).reply);
  EXPECT_EQ(state_2.power_permille, -1000);
  EXPECT_EQ(state_2.iq_A, 0);
}

// Full scale by series: 2048 is ±33 A on MG, ±16.5 A on MF and MH, both directions.
TEST(Dialect, CurrentScaleFollowsTheSeries) {
  struct Scale {
    Series series;
    double full_A;
  };
  for (const Scale& scale :
       {Scale{Series::kMg, 33.0}, Scale{Series::kMf, 16.5}, Scale{Series::kMh, 16.5}}) {
    for (const Dialect& dialect : {kLateLegacyDialect, kV235Dialect, kV236Dialect}) {
      const WireFormat format = wire_format(dialect, scale.series);
      EXPECT_DOUBLE_EQ(format.iq_command_lsb_A * 2048, scale.full_A);
      EXPECT_DOUBLE_EQ(format.iq_reply_lsb_A * 2048, scale.full_A);
    }
    EXPECT_DOUBLE_EQ(wire_format(kV236Dialect, scale.series).phase_current_lsb_A * 2048,
                     scale.full_A);
    EXPECT_EQ(wire_format(kV235Dialect, scale.series).phase_current_lsb_A, 1.0 / 64);
    EXPECT_EQ(wire_format(kLegacyDialect, scale.series).iq_command_lsb_A, 32.0 / 2000);
    EXPECT_EQ(wire_format(kLegacyDialect, scale.series).iq_reply_lsb_A, 33.0 / 2048);
  }
}

// --- sweeps

TEST(Dialect, EveryIqCommand) {
  for (const WireFormat& format : {kMgV236, kMfV236}) {
    expect_clamped<Torque>({"141#A100000000000000", 4, -2048, 2048, format},
                           format.iq_command_lsb_A,
                           [](const Torque& torque) { return torque.iq_A; });
    // A negative limit counts as 0.
    expect_clamped<Speed>({"141#A200000010270000", 2, 0, 2048, format}, format.iq_command_lsb_A,
                          [](const Speed& speed) { return speed.iq_limit_A; });
  }
}

TEST(Dialect, EveryOpenLoopPower) {
  expect_clamped<OpenLoop>({"141#A000000000000000", 4, -850, 850, kMsV236}, 1,
                           [](const OpenLoop& open_loop) { return open_loop.power_permille; });
}

TEST(Dialect, EverySixteenBitField) {
  expect_unchanged({{"141#9A00000000000000", 2, 0, 65535, kMfV235},
                    {"141#9A00000000000000", 2, 0, 65535, kMgV236},
                    {"141#9B00000000001000", 4, 0, 65535, kMgV236},
                    {"141#9400000000000500", 4, 0, 65535, kMgV236},
                    {"141#9400000005000000", 6, 0, 65535, kMgV236},
                    {"141#9C00000000000000", 2, -2048, 2048, kMfV236},
                    {"141#9C00000000000000", 2, -1000, 1000, kMsV236},
                    {"141#9D00000000000000", 6, 0, 65535, kMfV236},
                    {"141#C00A000000000000", 2, 0, 65535, kMgV236},
                    {"141#C00A000000000000", 4, 0, 65535, kMgV236},
                    {"141#C00A000000000000", 6, 0, 65535, kMgV236},
                    {"141#C01E000000000000", 4, 0, 65535, kMgV236},
                    {"141#C026000000000080", 4, 0, 65535, kMgV236}},
                   true);
}

TEST(Dialect, SaturatesAtTheEndOfTheField) {
  EXPECT_EQ(encode_reply(1, State1{ReadState1::kOpcode, 0, 700, 0, 400}, kMgV236),
            frame("141#9A00FFFFFF7F0000"));
  EXPECT_EQ(encode_reply(1, State1{ReadState1::kOpcode, 0, -1, 0, -400}, kMgV236),
            frame("141#9A00000000800000"));
  EXPECT_EQ(encode_reply(1, State2{ReadState2::kOpcode, 0, 17, 0, 0}, kMfV236),
            frame("141#9C00000800000000"));
  EXPECT_EQ(encode_reply(1, State2{ReadState2::kOpcode, 0, 0, 0, 0, 1200}, kMsV236),
            frame("141#9C00E80300000000"));
  EXPECT_EQ(encode_reply(1, SingleTurnAngle{70000}, kLegacyFormat), frame("141#940000000000FFFF"));
  EXPECT_EQ(encode_query(1, Position3{0, 70000}, kLegacyFormat), frame("141#A5000000FFFF0000"));
}

TEST(Dialect, LegacyIgnoresFieldsOfNewerGenerations) {
  for (const WireFormat& format : {kLegacyFormat, kMgLate}) {
    const auto decoded = [&format](const char* text) {
      return std::get<Query>(decode_query(frame(text), format)).command;
    };
    EXPECT_EQ(decoded("141#A2003E00A0860100"), Command{Speed{1000.0}});
    EXPECT_EQ(decoded("141#95000000B0040000"), Command{ClearAngle{}});
    EXPECT_EQ(decoded("141#A5010000407E0500"), (Command{Position3{kCounterClockwise, 0x7E40}}));
  }
}

TEST(Dialect, LateLegacyUsesTheScaleOfItsSeries) {
  struct Golden {
    const char* text;
    WireFormat format;
    Command command;
    int id = 1;
  };
  expect_queries(std::initializer_list<Golden>{
      {"141#A100000000080000", kMgLate, Torque{33}},    // 2048 of 66/4096 A
      {"141#A100000000080000", kMfLate, Torque{16.5}},  // 2048 of 33/4096 A
      {"141#A100000000F80000", kMfLate, Torque{-16.5}},
      {"280#0008000000F80004", kMgLate, MultiTorque{{33, 0, -33, 16.5}}, kMultiDrive},
      {"141#A2000000A0860100", kMgLate, Speed{1000.0}},
      {"141#A5010000407E0000", kMgLate, Position3{kCounterClockwise, 0x7E40}},
      {"141#A600F4019F8C0000", kMgLate, Position4{kClockwise, 500, 35999}},
      {"141#9100000000003412", kMgLate, WriteOffsetToRom{0x1234}},
      {"141#3000000000000000", kMgLate, ReadPid{}},
      {"141#340000000A000000", kMgLate, WriteAccelerationToRam{10}}});
}

// --- identifiers

TEST(Dialect, RepliesMayHaveOtherIdentifiers) {
  Dialect dialect = kV236Dialect;
  dialect.reply_id_base = 0x180;
  const WireFormat format = wire_format(dialect, Series::kMg);
  EXPECT_EQ(encode_reply(3, BrakeState{true}, format), frame("183#8C01000000000000"));
  EXPECT_EQ(std::get<ReplyFrame>(decode_reply(frame("1A0#8C01000000000000"), format)).id, 32);
  EXPECT_EQ(std::get<Reject>(decode_reply(frame("143#8C01000000000000"), format)),
            Reject::kForeignId);
  EXPECT_EQ(std::get<Query>(decode_query(frame("143#8C10000000000000"), format)).id, 3);
}

TEST(Dialect, RejectsUnknownMultiDriveIdentifiers) {
  for (const char* text :
       {"281#0000000000000000", "282#0000000000000000", "288#0000000000000000"}) {
    EXPECT_EQ(std::get<Reject>(decode_query(frame(text), kMfV235)), Reject::kForeignId);
  }
  EXPECT_EQ(std::get<Reject>(decode_query(frame("280#0000000000000000"), kMsV236)),
            Reject::kUnknownCommand);
}

TEST(Dialect, MultiCommandGivesEachDriveItsSlot) {
  const auto multi = std::get<Query>(decode_query(frame("288#9AFF9C008011FF00"), kMgV236));
  const auto first = std::get<Query>(for_drive(1, multi, kMgV236));
  EXPECT_EQ(first.command, Command{ReadState1{}});
  EXPECT_EQ(first.id, 1);
  EXPECT_EQ(first.data, (Payload{0x9A}));  // the high byte of the slot is unused
  EXPECT_EQ(std::get<Query>(for_drive(3, multi, kMgV236)).data, (Payload{0x80}));
  EXPECT_EQ(std::get<Reject>(for_drive(4, multi, kMgV236)), Reject::kUnknownCommand);
  EXPECT_EQ(std::get<Reject>(for_drive(5, multi, kMgV236)), Reject::kForeignId);
  const auto empty = std::get<Query>(decode_query(frame("288#00FF9C0000000000"), kMgV236));
  EXPECT_EQ(std::get<Reject>(for_drive(1, empty, kMgV236)), Reject::kForeignId);
  const auto torque = std::get<Query>(decode_query(frame("280#0100000000000000"), kMgV236));
  EXPECT_EQ(std::get<Query>(for_drive(5, torque, kMgV236)).command, torque.command);
}

}  // namespace dialect_test
}  // namespace lk::protocol
