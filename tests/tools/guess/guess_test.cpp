// Guesses the kind of a drive from a log: captures of real drives, and logs of emulated ones of
// known kind.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

#include "emulator/core/generation.hpp"
#include "tests/tools/guess/guess_support.hpp"
#include "tools/guess/traits.hpp"

namespace lk::emulator {
namespace guess_test {

using namespace std::chrono_literals;
using test::guessed;
using test::guessed_text;
using test::Json;
using test::Logged;
using test::possible_value_names;
using Keys = std::vector<std::string>;

// --- captures of real drives

/// docs/reference/protocol.md §10.7: 48.72 V at [2:3], and bytes 4 to 6 that are 0 in both newer
/// layouts.
TEST(Guess, IdentifiesTheLayoutOfOneState) {
  const auto drive = guessed({"  can0  141   [8]  9A 00 00 00 00 00 00 00",
                              "  can0  141   [8]  9A 24 08 13 00 00 00 00"})[0];
  EXPECT_EQ(drive["fits"], (Keys{"v235", "v236", "v236b"}));
  EXPECT_EQ(possible_value_names(drive, "state_1"),
            (Keys{"centivolt", "centivolt_and_bus_current"}));
  EXPECT_EQ(drive["findings"][0]["values"][1]["frames"][0]["frame"], "141#9A24081300000000");
}

/// Documented replies of an MF7015 (docs/reference/protocol.md §10): 24.0 V as 240 at [3:4], a
/// state at 25 °C. Its angle of 180.00° is 0x4650 at [4:5], where a 16-bit drive has zeros.
TEST(Guess, IdentifiesAGenerationOfMixedLayouts) {
  const auto out =
      guessed({"(1.000000) can0 141#9A00000000000000", "(1.000300) can0 141#9A1900F000000000",
               "(1.010000) can0 141#9400000000000000", "(1.010300) can0 141#9400000050460000"});
  EXPECT_EQ(out[0]["fits"], Keys{"late-legacy"});
  EXPECT_EQ(out[0]["quirks"], Json::object());
  EXPECT_EQ(out[1]["commands"], Keys{"lk-emu --bus vcan0 --ids 1 --generation late-legacy"});
}

TEST(Guess, NamesTheSwitchesOfUnknownMixtures) {
  // Newer voltage format, 23.88 V, with an angle of 98.10° = 0x2652 in 16 bits at [6:7].
  const auto out =
      guessed({"(1.000000) can0 142#9A00000000000000", "(1.000300) can0 142#9A1F540900000000",
               "(1.010000) can0 142#9400000000000000", "(1.010300) can0 142#9400000000005226"});
  EXPECT_EQ(out[0]["fits"], Json::array());
  EXPECT_EQ(out[0]["nearest"], "v235");
  EXPECT_EQ(out[0]["quirks"], (Json{{"single_turn_bits", "16"}}));
  EXPECT_EQ(out[1]["commands"],
            Keys{"lk-emu --bus vcan0 --ids 2 --generation v235 --quirk single_turn_bits=16"});
}

/// Examples of docs/reference/rs485.md: 48.7 V at D[2:3] is the oldest manual's format; a drive
/// with 48.72 V at D[1:2] that answers 0xC0 is V2.36.
TEST(Guess, IdentifiesTheManualOfRs485Drives) {
  EXPECT_EQ(guessed({"(1.000000) bus rs485#3E9A0100D9",
                     "(1.000400) bus rs485#3E9A0107E02400E7010000000C"})[0]["fits"],
            (Keys{"legacy", "late-legacy"}));
  const auto newer = guessed(
      {"(1.000000) bus rs485#3E9A0100D9", "(1.000400) bus rs485#3E9A0107E0240813000000003F"});
  EXPECT_EQ(newer[0]["fits"], (Keys{"v235", "v236", "v236b"}));
  std::vector<std::string> asks;
  for (const auto& ask : newer[0]["ask"]) asks.push_back(ask["send"]);
  EXPECT_NE(std::ranges::find(asks, "rs485#3EC00107060A0000000000000A"), asks.end());
  const auto out = guessed({"(1.000000) rs485:/dev/ttyUSB0 rs485#3E9A0100D9",
                            "(1.000400) rs485:/dev/ttyUSB0 rs485#3E9A0107E0240813000000003F",
                            "(1.010000) rs485:/dev/ttyUSB0 rs485#3EC00107060A0000000000000A",
                            "(1.010400) rs485:/dev/ttyUSB0 rs485#3EC00107060A64001400050087"});
  EXPECT_EQ(out[0]["fits"], (Keys{"v236", "v236b"}));
  EXPECT_EQ(out[0]["quirks"], Json::object());
  // Not the port of the log.
  EXPECT_EQ(out[1]["commands"], Keys{"lk-emu --bus rs485:/tmp/arm --ids 1 --generation v236"});
}

/// From the log of a real MS4015 (docs/reference/rs485.md): 58 bytes of product data, two bytes in
/// reply to 0x42, six to 0x90. Only V2.35 does this.
TEST(Guess, UsesEveryCommandOfRs485) {
  const Keys lines{"(1.000000) u rs485#3E12010051",
                   "(1.000900) u rs485#3E12013A8B4453343052370000000000000000000000000000"
                   "4D533430313500000000000000000000000000003537353030327318"
                   "78034A4B2C01C800EB009C",
                   "(1.010000) u rs485#3E4201078897320014000000DD",
                   "(1.010400) u rs485#3E42010283970097",
                   "(1.020000) u rs485#3E900100CF",
                   "(1.020400) u rs485#3E900106D52519011EDC043D"};
  const auto out = guessed(lines);
  EXPECT_EQ(out[0]["fits"], Keys{"v235"});
  EXPECT_EQ(out[0]["quirks"], Json::object());
  EXPECT_EQ(out[0]["product"],
            (Json{{"motor", "MS4015"}, {"driver", "DS40R7"}, {"firmware", "2.35"}}));
  EXPECT_EQ(out[0]["encoder_largest"], 0x1925);
  EXPECT_EQ(possible_value_names(out[0], "series"), Keys{"MS"});
  EXPECT_EQ(out[1]["commands"],
            Keys{"lk-emu --bus rs485:/tmp/arm --ids 1 --generation v235 --motor ms4015"});
  EXPECT_EQ(guessed_text(lines).find("u, drive 1: v235; calls itself MS4015 with driver DS40R7, "
                                     "firmware 2.35; encoder up to 6437: 13 bits or more "
                                     "(queries: 3, replies: 3)\n"),
            0U)
      << guessed_text(lines);
}

/// 0x92 and the field of 0x9C at rest, 90 rotor degrees further each time. By
/// docs/start/which-drive.md, 65536 counts are a rotor turn for some hosts of the MG4005. For
/// others they are an output turn, which is ten rotor turns.
TEST(Guess, InfersTheEncoderSpanFromAngles) {
  for (const auto& [step, span] : {std::pair{16384, "rotor_turn"}, {1638, "output_turn"}}) {
    Keys lines;
    for (int n = 0; n < 5; ++n) {
      const auto counts = static_cast<unsigned>(n * step) & 0xFFFFU;
      const unsigned cdeg = 9000U * static_cast<unsigned>(n) + 1;
      const auto say = [&lines, n](int us, const std::string& data) {
        lines.push_back(fmt::format("(1.{:06}) can0 141#{}", 100'000 * n + us, data));
      };
      say(0, "9C00000000000000");
      say(300, fmt::format("9C1900000000{:02X}{:02X}", counts & 0xFFU, counts >> 8U));
      say(1000, "9200000000000000");
      say(1300, fmt::format("92{:02X}{:02X}{:02X}00000000", cdeg & 0xFFU, cdeg >> 8U & 0xFFU,
                            cdeg >> 16U));
    }
    const auto drive = guessed(lines)[0];
    EXPECT_EQ(possible_value_names(drive, "encoder_span"), Keys{span});
    EXPECT_NEAR(drive["encoder_counts_per_turn"].get<double>(), 4 * step, 4);
  }
}

/// Field of 0x9C at rest and 0x92, 90° further each time.
Keys quarter_turns(int counts_per_turn) {
  Keys lines;
  for (int n = 0; n < 4; ++n) {
    const auto counts = static_cast<unsigned>(n * counts_per_turn / 4 + 5);
    const unsigned cdeg = 9000U * static_cast<unsigned>(n) + 1;
    lines.push_back(fmt::format("(1.{:06}) can0 141#9C00000000000000", 100'000 * n));
    lines.push_back(fmt::format("(1.{:06}) can0 141#9C1900000000{:02X}{:02X}", 100'000 * n + 300,
                                counts & 0xFFU, counts >> 8U));
    lines.push_back(fmt::format("(1.{:06}) can0 141#9200000000000000", 100'000 * n + 1000));
    lines.push_back(fmt::format("(1.{:06}) can0 141#92{:02X}{:02X}0000000000", 100'000 * n + 1300,
                                cdeg & 0xFFU, cdeg >> 8U));
  }
  return lines;
}

TEST(Guess, InfersTheEncoderBitsFromAngles) {
  EXPECT_EQ(possible_value_names(guessed(quarter_turns(16384))[0], "encoder_bits"), Keys{"14"});
  EXPECT_EQ(possible_value_names(guessed(quarter_turns(65536))[0], "encoder_bits"), Keys{"16"});
  EXPECT_EQ(possible_value_names(guessed(quarter_turns(4096))[0], "encoder_bits"), Keys{});
}

/// 14 bits reach 16383, 0x3FFF.
TEST(Guess, InfersTheEncoderBitsFromTheLargestValue) {
  const auto bits = [](const std::string& field) {
    return possible_value_names(guessed({"can0 141 [8] 9C 19 02 00 03 00 " + field})[0],
                                "encoder_bits");
  };
  EXPECT_EQ(bits("FF 3F"), Keys{});
  EXPECT_EQ(bits("00 40"), Keys{"16"});
  const std::string forwards = "can0 141 [8] 9C 19 02 00 03 00 ";
  const std::string backwards = "can0 141 [8] 9C 19 02 00 FD FF ";
  const auto bits_of = [](const Keys& lines) {
    return possible_value_names(guessed(lines)[0], "encoder_bits");
  };
  EXPECT_EQ(bits_of({forwards + "F0 3F", forwards + "10 00", backwards + "E0 3F"}), Keys{"14"});
  // A joint that moves back and forth within a quarter of 65536 counts does not wrap.
  EXPECT_EQ(bits_of({forwards + "10 00", forwards + "F0 3F", backwards + "10 00"}), Keys{});
}

/// `legacy` MF drives have 14 bits, later ones 16: the command names the others.
TEST(GuessStarts, IncludeEncoderBitsThatDiffer) {
  const std::string v235 = "can0 141 [8] 94 00 00 00 50 46 00 00";
  const std::string wide = "can0 141 [8] 9C 19 02 00 03 00 00 40";
  const auto early = guessed({wide});
  EXPECT_EQ(early[0]["quirks"], (Json{{"encoder_bits", "16"}}));
  const auto servo = test::started(early[1]["commands"][0])[0].servos[0];
  EXPECT_EQ(servo.profile.drive.encoder.bits, 18);
  EXPECT_EQ(guessed({wide, v235})[0]["quirks"], Json::object());
  Keys narrow = quarter_turns(16384);
  EXPECT_EQ(guessed(narrow)[0]["quirks"], (Json{{"encoder_span", "rotor_turn"}}));
  narrow.push_back("(2.000000) can0 141#9400000050460000");
  EXPECT_EQ(guessed(narrow)[0]["quirks"],
            (Json{{"encoder_span", "rotor_turn"}, {"encoder_bits", "14"}}));
}

/// An MG4005-i10 of §10.7 in a log without queries.
TEST(Guess, NeedsNoQueries) {
  EXPECT_EQ(guessed({"can0  141   [8]  9A 1F 54 09 00 00 00 00"})[0]["fits"],
            (Keys{"v235", "v236", "v236b"}));
}

// --- ambiguous frames

/// 26.4 V as 264 = 0x0108 at [3:4] equals 20.48 V at [2:3] with 0.01 A at [4:5]. In the other order
/// 25.60 V come with 1 LSB of current.
TEST(Guess, IgnoresAmbiguousFrames) {
  const auto drive = guessed({"can0 141 [8] 9A 19 00 08 01 00 00 00"})[0];
  EXPECT_EQ(possible_value_names(drive, "state_1"),
            (Keys{"decivolt", "centivolt_and_bus_current"}));
  // 0.01° at [6:7] equals 655.36° at [4:7].
  const auto angle = guessed({"can0 141 [8] 94 00 00 00 00 00 01 00"})[0];
  EXPECT_EQ(angle["fits"].size(), protocol::kGenerationRows.size());
}

/// A drive that is off sends 0x10 in byte 6, if it has that byte.
TEST(Guess, InfersBusCurrentFromAnOffDrive) {
  const Keys lines{"(1.000000) can0 141#8000000000000000", "(1.000300) can0 141#8000000000000000",
                   "(1.010000) can0 141#9A00000000000000", "(1.010300) can0 141#9A24081300001000"};
  EXPECT_EQ(guessed(lines)[0]["fits"], (Keys{"v236", "v236b"}));
}

TEST(Guess, InfersOutputTurnFromAnglesBeyondATurn) {
  // 359999 = 0x57E3F: 3599.99°, the last value of an i10.
  const auto drive = guessed({"can0 141 [8] 94 00 00 00 3F 7E 05 00"})[0];
  EXPECT_EQ(possible_value_names(drive, "single_turn_bits"), Keys{"32"});
  EXPECT_EQ(possible_value_names(drive, "encoder_span"), Keys{"output_turn"});
}

/// Returns queries every 10 ms, each with a reply after 0.3 ms, except for the `silent` command.
Keys dialogue(const Keys& commands, std::string_view silent) {
  Keys lines;
  double at_s = 1;
  const auto say = [&lines](double time_s, const std::string& data) {
    lines.push_back("(" + std::to_string(time_s) + ") can0 141#" + data);
  };
  for (const std::string& command : commands) {
    say(at_s, command + std::string(16 - command.size(), '0'));
    if (command != silent) say(at_s + 0.0003, command.substr(0, 2) + "19020003002108");
    at_s += 0.01;
  }
  return lines;
}

TEST(Guess, InfersMissingCommandsFromRepeatedSilence) {
  const auto drive = guessed(dialogue({"9C", "30", "9C", "30", "9C"}, "30"))[0];
  EXPECT_EQ(possible_value_names(drive, "pid_commands"), Keys{"false"});
  EXPECT_EQ(drive["fits"], (Keys{"v235", "v236", "v236b"}));
  EXPECT_EQ(drive["findings"][1]["values"][0]["frames"][0]["frame"], "141#3000000000000000");
  for (const Keys& unclear : {Keys{"9C", "30", "9C", "9C", "9C"},
                              // Without earlier or later replies the drive may have had no power.
                              {"30", "30", "30", "9C", "9C"},
                              {"9C", "9C", "30", "30", "30"}}) {
    EXPECT_EQ(possible_value_names(guessed(dialogue(unclear, "30"))[0], "pid_commands"), Keys{})
        << testing::PrintToString(unclear);
  }
}

/// If every third reply is lost, two missing replies prove nothing.
TEST(Guess, IgnoresSilenceOnALossyBus) {
  Keys lines;
  for (int n = 0; n < 30; ++n) {
    const std::string at = std::to_string(1 + 0.01 * n);
    lines.push_back("(" + at + ") can0 141#9C00000000000000");
    if (n % 3 != 0)
      lines.push_back("(" + std::to_string(1.0003 + 0.01 * n) + ") can0 141#9C19020003002108");
    if (n == 10 || n == 20) {
      lines.push_back("(" + std::to_string(1.005 + 0.01 * n) + ") can0 141#3000000000000000");
    }
  }
  EXPECT_EQ(possible_value_names(guessed(lines)[0], "pid_commands"), Keys{});
}

TEST(Guess, ReportsUndecidedTraits) {
  const auto out =
      guessed({"(1.000000) can0 141#9A00000000000000", "(1.000300) can0 141#9A24081300000000",
               "(1.100000) can0 145#9A00000000000000", "(1.300000) can0 145#9A00000000000000"});
  const Json brake{{"key", "brake_command"}, {"send", "141#8C10000000000000"}};
  EXPECT_NE(std::ranges::find(out[0]["ask"], brake), out[0]["ask"].end());
  EXPECT_EQ(
      out[1],
      (Json{
          {"type", "drive"}, {"interface", "can0"}, {"drive", 5}, {"queries", 2}, {"replies", 0}}));
}

TEST(Guess, DetectsReplyIdentifiers) {
  Keys lines;
  for (int n = 0; n < 3; ++n) {
    lines.push_back("(" + std::to_string(1 + n) + ".000000) can0 141#9A00000000000000");
    lines.push_back("(" + std::to_string(1 + n) + ".000300) can0 181#9A1900F000000000");
  }
  EXPECT_EQ(possible_value_names(guessed(lines)[0], "reply_id_base"), Keys{"0x180"});
}

/// MyActuator drives from V3 on reply on 0x240 + ID.
TEST(Guess, NamesUnsupportedDrives) {
  Keys lines;
  for (int n = 0; n < 3; ++n) {
    lines.push_back("(" + std::to_string(1 + n) + ".000000) can0 141#9C00000000000000");
    lines.push_back("(" + std::to_string(1 + n) + ".000300) can0 241#9C32640000002D00");
  }
  const auto out = guessed(lines);
  EXPECT_EQ(out[0]["foreign"], true);
  EXPECT_EQ(out[1]["commands"], Json::array());
  EXPECT_NE(guessed_text(lines).find("MyActuator"), std::string::npos);
}

TEST(Guess, ReportsTwoKindsWithOneId) {
  const auto drive =
      guessed({"can0 141 [8] 9A 1F 54 09 00 00 00 00", "can0 141 [8] 9A 19 00 F0 00 00 00 00",
               "can0 141 [8] 9A 1F 54 09 00 00 00 00", "can0 141 [8] 9A 19 00 F0 00 00 00 00"})[0];
  EXPECT_EQ(drive["contradictory"], Keys{"state_1"});
}

/// One deviating frame in a hundred does not change the result.
TEST(Guess, ToleratesOneDeviatingFrameInAHundred) {
  Keys lines(100, "can0 141 [8] 9A 19 00 F0 00 00 00 00");
  lines.push_back("can0 141 [8] 9A 1F 54 09 00 00 00 00");
  EXPECT_EQ(possible_value_names(guessed(lines)[0], "state_1"), Keys{"decivolt"});
}

TEST(Guess, PrintsFindingsWithTheirFrames) {
  const Keys lines{"(1.000000) can0 141#9A00000000000000", "(1.000300) can0 141#9A1900F000000000",
                   "(1.010000) can0 141#9400000000000000", "(1.010300) can0 141#9400000050460000"};
  const std::string text = guessed_text(lines);
  for (const char* const words :
       {"drive 1: late-legacy",
        "state_1 = decivolt: 0x9A: voltage 0.1 V at [3:4] (frames for it: 1, against: 0)",
        "0.000300  141#9A1900F000000000", "--generation late-legacy"}) {
    EXPECT_NE(text.find(words), std::string::npos) << words << " in\n" << text;
  }
  EXPECT_NE(guessed_text(lines, Language::kChinese).find("驱动器 1：late-legacy"),
            std::string::npos);
}

// --- commands that emulate the drives

/// 23.88 V at [2:3] and 98.10° in 16 bits at [6:7]: v235 or v236, except for its angle.
const Keys kMixture{"(1.000000) can0 141#9A00000000000000", "(1.000300) can0 141#9A1F540900000000",
                    "(1.020000) can0 141#9400000000000000", "(1.020300) can0 141#9400000000005226"};

TEST(GuessStarts, UseAFileForSeveralKinds) {
  Keys lines = kMixture;
  // 2 is MS, by its reply to 0xA0; 3 and 4 are late-legacy, by 24.0 V at [3:4] and 180° at [4:7].
  for (const char* const line :
       {"can0 142#A000000000000000", "can0 142#A019020003002108", "can0 143#9A1900F000000000",
        "can0 143#9400000050460000", "can0 144#9A1900F000000000", "can0 144#9400000050460000"}) {
    lines.push_back("(" + std::to_string(1.1 + 0.01 * static_cast<double>(lines.size())) + ") " +
                    line);
  }
  const Json summary = guessed(lines).back();
  EXPECT_EQ(summary["commands"], Json::array());
  const std::string robot = summary["robot"];
  EXPECT_NE(guessed_text(lines).find("As robot.toml, for lk-emu --config ./robot.toml"),
            std::string::npos);
  EXPECT_NE(guessed_text(lines).find(robot), std::string::npos);
  const auto buses = parse_config(robot, "robot.toml", {}, test::profile);
  ASSERT_EQ(buses.size(), 1U);
  EXPECT_EQ(buses[0].interface, "vcan0");
  const auto& servos = buses[0].servos;
  ASSERT_EQ(servos.size(), 4U) << robot;
  EXPECT_EQ(servos[0].generation, Generation::kV235);
  EXPECT_FALSE(servos[0].quirks.dialect.wide_single_turn);
  EXPECT_EQ(servos[1].profile.series, Series::kMs);
  EXPECT_TRUE(servos[1].quirks.dialect.open_loop_command);
  EXPECT_EQ(servos[2].generation, Generation::kLateLegacy);
  EXPECT_EQ(servos[3].quirks, quirks_of(Generation::kLateLegacy));
}

TEST(GuessStarts, IncludeEncoderSpanAndMsMotor) {
  const auto wide = guessed({"can0 141 [8] 94 00 00 00 3F 7E 05 00"});
  EXPECT_EQ(wide[0]["quirks"], (Json{{"encoder_span", "output_turn"}}));
  const auto servo = test::started(wide[1]["commands"][0])[0].servos[0];
  EXPECT_EQ(servo.quirks.encoder_span, EncoderSpan::kOutputTurn);

  const Keys ms{"(1.000000) can0 141#A000000000000000", "(1.000300) can0 141#A019020003002108"};
  EXPECT_EQ(test::started(guessed(ms)[1]["commands"][0])[0].servos[0].profile.series, Series::kMs);
  EXPECT_NE(guessed_text(ms).find("ms4010 is a stand-in"), std::string::npos);
}

/// Names of interfaces in a log may be hostile, and users copy the command to a shell.
TEST(GuessStarts, UseUniqueShellSafeVirtualNames) {
  const std::string reply = " 141 [8] 9A 19 00 F0 00 00 00 00";
  const Json summary = guessed({"can0" + reply, "vcan0" + reply, "vcan$(reboot)" + reply,
                                "vxcan12" + reply, "vcan2;a" + reply})
                           .back();
  std::set<std::string> names;
  for (const std::string command : summary["commands"]) {
    EXPECT_EQ(command.find_first_of("$();"), std::string::npos) << command;
    names.insert(test::started(command)[0].interface);
  }
  EXPECT_EQ(names, (std::set<std::string>{"vcan0", "vcan1", "vcan2", "vcan3", "vxcan12"}));
}

TEST(GuessStarts, NameAssumptions) {
  EXPECT_NE(guessed_text({"can0 141 [8] 9C 19 02 00 03 00 21 08"})
                .find("    nothing in the log tells the generation: legacy is the default\n"),
            std::string::npos);
  EXPECT_NE(guessed_text({"can0 141 [8] 9A 1F 54 09 00 00 00 00"})
                .find("--generation v235\n    or generation v236 or v236b\n"),
            std::string::npos);
}

TEST(Guess, SuggestsQueriesForMixtures) {
  const auto drive = guessed(kMixture)[0];
  EXPECT_EQ(drive["fits"], Json::array());
  const Json brake{{"key", "brake_command"}, {"send", "141#8C10000000000000"}};
  EXPECT_NE(std::ranges::find(drive["ask"], brake), drive["ask"].end());
}

TEST(Guess, CountsFramesOfExcessInterfaces) {
  Keys lines;
  for (int n = 0; n < 34; ++n) {
    lines.push_back("can" + std::to_string(n) + " 141 [8] 9C 19 02 00 03 00 21 08");
  }
  EXPECT_EQ(guessed(lines).back()["unread_frames"], 2);
  EXPECT_EQ(guessed(lines).back()["bad_lines"], 0);
  EXPECT_NE(guessed_text(lines).find("Frames of further interfaces, not read (max 32): 2\n"),
            std::string::npos);
}

/// docs/reference/formats.md shows the output for this log.
TEST(Guess, MatchesTheDocument) {
  std::ostringstream page;
  page << std::ifstream(LKEMU_SOURCE_DIR "/docs/reference/formats.md").rdbuf();
  // 48.72 V at [2:3], and 180° in 32 bits.
  std::istringstream out(guessed_text(
      {"(1.000000) can0 141#9A00000000000000", "(1.000300) can0 141#9A24081300000000",
       "(1.020000) can0 141#9400000000000000", "(1.020300) can0 141#9400000050460000"}));
  std::string sample;
  for (std::string line; std::getline(out, line);)
    sample += line.empty() ? "\n" : "    " + line + "\n";
  EXPECT_NE(page.str().find(sample), std::string::npos) << sample;
}

// --- tables

/// Changing a switch changes the replies to its own commands only.
TEST(GuessTraits, MapEveryCommandToItsSwitch) {
  struct Case {
    Trait trait;
    bool protocol::Dialect::*member;
  };
  for (const Case& c : {Case{Trait::kPid, &protocol::Dialect::pid_commands},
                        Case{Trait::kOffset, &protocol::Dialect::offset_command},
                        Case{Trait::kBrake, &protocol::Dialect::brake_command},
                        Case{Trait::kParameters, &protocol::Dialect::parameter_commands},
                        Case{Trait::kOpenLoop, &protocol::Dialect::open_loop_command}}) {
    auto on = protocol::wire_format(protocol::kLegacyDialect, Series::kMs);
    auto off = on;
    on.dialect.*c.member = true;
    off.dialect.*c.member = false;
    for (const auto& row : protocol::commands()) {
      const bool depends = protocol::answers(on, row.opcode) != protocol::answers(off, row.opcode);
      EXPECT_EQ(depends, trait_of_command(row.opcode, protocol::Framing::kCan) == c.trait)
          << row.name;
    }
  }
  for (const auto& row : protocol::commands()) {
    EXPECT_EQ(row.fits == protocol::Fits::kAllButMs,
              trait_of_command(row.opcode, protocol::Framing::kCan) == Trait::kSeries)
        << row.name;
  }
}

/// A command that only some RS-485 presets have distinguishes them.
TEST(GuessTraits, DistinguishPresetsOnRs485) {
  for (const auto& row : protocol::serial_commands()) {
    if (!row.answered) continue;  // its silence proves nothing
    std::set<bool> answered;
    for (const auto& generation : protocol::kGenerationRows) {
      answered.insert(
          protocol::answers(protocol::wire_format(generation.serial, Series::kMf), row.opcode));
    }
    if (answered.size() < 2) continue;
    const auto trait = trait_of_command(row.opcode, protocol::Framing::kSerial);
    ASSERT_TRUE(trait) << row.name;
    EXPECT_TRUE(shows_on(*trait, protocol::Framing::kSerial)) << row.name;
  }
}

}  // namespace guess_test
}  // namespace lk::emulator
