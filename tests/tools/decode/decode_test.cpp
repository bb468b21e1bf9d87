// Decoded frames from candump output. Lines as can-utils 2020.11 printed them on a real bus;
// meanings worked out by hand from docs/reference/protocol.md.

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "emulator/core/generation.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/monitor/frames/decode_words.hpp"
#include "protocol/field_values.hpp"
#include "tests/tools/decode/decode_support.hpp"

namespace lk::emulator {
namespace decode_test {

/// docs/reference/protocol.md §2: iq of replies is 33/2048 A in legacy; §10.2: 33/4096 A on MF from
/// v235 on.
TEST(Decode, ReadsValuesInTheScaleOfTheDrive) {
  const std::vector<std::string> lines = {"(10.000000) a 141#9C00000000000000",
                                          "(10.000338) a 141#9C19020003002108"};
  const auto legacy = decode(lines);
  EXPECT_EQ(roles(legacy), (Roles{"query", "reply"}));
  EXPECT_EQ(legacy[1]["values"],
            Json::parse(R"({"temperature_C":25,"iq_A":0.0322265625,"speed_dps":3,
                            "encoder_counts":2081})"));
  EXPECT_EQ(legacy[1]["drive"], 1);
  EXPECT_EQ(legacy[1]["name"], "read state 2");
  EXPECT_EQ(legacy[1]["time_s"], 10.000338);
  EXPECT_NEAR(legacy[1]["latency_ms"].get<double>(), 0.338, 1e-9);
  const auto v236 = decode(lines, json_options(Generation::kV236, Series::kMf));
  EXPECT_EQ(v236[1]["values"]["iq_A"], 2 * 33.0 / 4096);
  const auto ms = decode(lines, json_options(Generation::kV236, Series::kMs));
  EXPECT_EQ(ms[1]["values"]["power_permille"], 2);
}

/// Returns lines of a drive with a known reply time, then 0x81 at 50 Hz. Each has an echo after 0.3
/// ms, except the `lost` ones.
std::vector<std::string> stops_with_echoes(int count, const std::vector<int>& lost) {
  std::vector<std::string> lines = {"(10.000000) a 141#9C00000000000000",
                                    "(10.000300) a 141#9C19020003002108"};
  const auto say = [&lines](double at_s) {
    std::string stamp = std::to_string(at_s);
    lines.push_back("(" + stamp + ") a 141#8100000000000000");
  };
  for (int n = 0; n < count; ++n) {
    const double at_s = 10.5 + 0.02 * n;
    say(at_s);
    if (std::ranges::find(lost, n) == lost.end()) say(at_s + 0.0003);
  }
  return lines;
}

TEST(Decode, TakesALateEchoForARepeatedQuery) {
  const Json one_lost = tally(decode(stops_with_echoes(20, {7})), 1, "81");
  EXPECT_EQ(one_lost["queries"], 20) << one_lost;
  EXPECT_EQ(one_lost["replies"], 19);
  EXPECT_EQ(one_lost["unanswered"], 1);

  std::vector<int> all(20);
  std::iota(all.begin(), all.end(), 0);
  const Json dead = tally(decode(stops_with_echoes(20, all)), 1, "81");
  EXPECT_EQ(dead["queries"], 20) << dead;
  EXPECT_EQ(dead["replies"], 0);
  EXPECT_EQ(dead["unanswered"], 19) << "the log ends while the last waits";
}

/// Captures of real drives, docs/reference/protocol.md §10.7.
TEST(Decode, ReadsCapturesOfRealDrives) {
  const auto out = decode(
      {"  can0  141   [8]  9A 00 00 00 00 00 00 00", "  can0  141   [8]  9A 24 08 13 00 00 00 00"},
      json_options(Generation::kV236, Series::kMg));
  EXPECT_EQ(roles(out), (Roles{"query", "reply"}));
  EXPECT_EQ(out[1]["values"]["temperature_C"], 36);
  EXPECT_NEAR(out[1]["values"]["voltage_V"].get<double>(), 48.72, 1e-9);
  EXPECT_EQ(out[1]["values"]["bridge_on"], 1);
  EXPECT_FALSE(out[1].contains("latency_ms")) << "there are no stamps";
  EXPECT_FALSE(out[1].contains("time_s"));
}

TEST(Decode, PrintsErrorsInWords) {
  // 0x09: under-voltage and motor over-temperature; 18.5 V are 185 = 0xB9.
  const std::vector<std::string> lines = {"(1.0) a 142#9A00000000000000",
                                          "(1.0003) a 142#9A5000B900000009"};
  const auto out = decode(lines);
  EXPECT_EQ(out[1]["mark"], "error");
  EXPECT_EQ(out[1]["values"]["errors"], 9);
  EXPECT_EQ(out[1]["values"]["error_words"], Json({"under_voltage", "motor_temperature"}));
  EXPECT_EQ(out[1]["values"]["voltage_V"], 18.5);
  const Json errors = out.back()["buses"][0]["errors"];
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_EQ(errors[0]["drive"], 2);
  EXPECT_EQ(errors[0]["first_time_s"], 1.0003);
  DecodeOptions chinese = json_options();
  chinese.language = Language::kChinese;
  EXPECT_NE(text(lines, chinese).find("温度 80 °C，电压 18.5 V，欠压、电机过温"), std::string::npos)
      << text(lines, chinese);
}

TEST(Decode, ReadsCommands) {
  // 0x04B0 = 1200 of 0.01 deg after 0x012C = 300 dps, counter-clockwise; 0x64 = 100 of 16 mA.
  const auto out = decode({"(1.0) a 141#A6012C01B0040000", "(1.1) a 141#A100000064000000",
                           "(1.2) a 280#640000009CFF0000"});
  EXPECT_EQ(out[0]["values"], Json::parse(R"({"angle_deg":12,"direction":1,"max_speed_dps":300})"));
  EXPECT_NEAR(out[1]["values"]["iq_A"].get<double>(), 1.6, 1e-12);
  EXPECT_EQ(out[2]["role"], "query");
  EXPECT_EQ(out[2]["drive"], 0);
  EXPECT_NEAR(out[2]["values"]["1"].get<double>(), 1.6, 1e-12);
  EXPECT_EQ(out[2]["values"]["2"], 0);
  EXPECT_NEAR(out[2]["values"]["3"].get<double>(), -1.6, 1e-12);
}

/// §10.5: Max Torque Current has the LSB of 0xA1, which is 66/4096 A on MG; 0x320 = 800.
TEST(Decode, GivesParametersTheirUnits) {
  const auto out = decode({"(1.0) a 141#C11E000020030000", "(1.0003) a 141#C11E000020030000",
                           "(1.1) a 141#C020000000000000", "(1.1003) a 141#C0200000A08C0000"},
                          json_options(Generation::kV236, Series::kMg));
  EXPECT_EQ(out[0]["values"]["max_current_A"], 800 * 66.0 / 4096);
  EXPECT_EQ(out[3]["role"], "reply");
  EXPECT_EQ(out[3]["values"]["max_speed_dps"], 360);  // 0x8CA0 = 36000 of 0.01 dps
}

TEST(Decode, ReportsReasonsForUndecodableFrames) {
  const auto out = decode({"(1.0) a 141#R", "(1.0) a 00000141#9C00000000000000", "(1.0) a 141##09C",
                           "(1.0) a 7DF#0102", "(1.0) a 141#9C", "(1.0) a 141#7E00000000000000",
                           "(1.0) a 141#8C00000000000000", "(1.0) a 20000060#0000000000000000"});
  const std::vector<std::string> reasons = {
      "remote request", "29-bit identifier", "CAN FD",          "no drive's identifier",
      "wrong length",   "unknown command",   "unknown command", "error frame"};
  for (std::size_t n = 0; n < reasons.size(); ++n) EXPECT_EQ(out[n]["drawback"], reasons[n]);
  EXPECT_EQ(out[7]["mark"], "error");
  EXPECT_EQ(out[7]["error_words"], Json({"no acknowledgement", "bus-off"}));
  EXPECT_EQ(out.back()["buses"][0]["meaningless"]["unknown command"], 2);
  EXPECT_EQ(out.back()["buses"][0]["commands_of_other_generations"], 1) << "0x8C, the brake";
  EXPECT_TRUE(out.back()["generation_assumed"]);
}

/// §10.7: 48.72 V as 0.01 V at [2:3]; legacy has 0 there and 0.1 V at [3:4].
TEST(Decode, ReportsStatesOfAnotherGeneration) {
  const std::vector<std::string> lines = {
      "(1.0) a 141#9A00000000000000", "(1.0003) a 141#9A24081300000000",
      "(2.0) a 141#9A00000000000000", "(2.0003) a 141#9A24081300000000"};
  EXPECT_EQ(decode(lines).back()["odd_states"], 2);
  EXPECT_EQ(decode(lines, json_options(Generation::kV235)).back()["odd_states"], 0);
  const std::string said = text(lines, json_options());
  EXPECT_NE(said.find("does not look like the generation"), std::string::npos);
  EXPECT_EQ(said.find("does not look like"), said.rfind("does not look like")) << "said once";
  // 24.0 V from a legacy drive.
  EXPECT_EQ(decode({"(1.0) a 141#9A00000000000000", "(1.0003) a 141#9A1900F000000000"})
                .back()["odd_states"],
            0);
}

// --- RS-485

/// The vendor's example of broadcast mode (docs/reference/rs485.md), 100 to drive 1 and -100 to
/// drive 3. The replies equal those to 0xA1: 25 °C, iq 100 and -100, speed 3, encoder 0x0821.
const std::vector<std::string> kBroadcast = {"(1.000000) u rs485#0280640000009CFF000081",
                                             "(1.000300) u rs485#3EA10107E719640003002108A9",
                                             "(1.000600) u rs485#3EA10307E9199CFF03002108E0"};

TEST(DecodeSerial, ReadsBroadcastsInEveryGeneration) {
  for (std::size_t n = 0; n < protocol::kGenerationRows.size(); ++n) {
    for (const char* const mark : {"", " R", " T"}) {
      const auto out = decode({kBroadcast[0] + mark, kBroadcast[1] + mark},
                              json_options(static_cast<Generation>(n)));
      EXPECT_EQ(roles(out), (Roles{"query", "reply"})) << n << mark;
      EXPECT_EQ(out[0]["command"], "280");
      EXPECT_EQ(out[0].count("drawback"), 0U);
      EXPECT_EQ(out[1]["values"]["speed_dps"], 3);
    }
  }
  // 100 counts of 33/4096 A.
  EXPECT_EQ(decode({kBroadcast[0]}, json_options(Generation::kV235))[0]["values"]["1"],
            100 * 33.0 / 4096);
}

/// V2.35 has 0x12, 0x1F, 0x40, 0x42, 0x44, 0x8C and 0x93 on RS-485 only. 0x12 and 0x42 come from
/// the log of an MS4015, the others are by hand from docs/reference/rs485.md.
TEST(DecodeSerial, UsesRs485Commands) {
  const std::vector<std::string> talk = {"3E12010051",
                                         "3E12013A8B4453343052370000000000000000000000000000"
                                         "4D533430313500000000000000000000000000003537353030327318"
                                         "78034A4B2C01C800EB009C",
                                         "3E4201078897320014000000DD",
                                         "3E42010283970097",
                                         "3E1F01005E",
                                         "3E1F010260112031",
                                         "3E40010281960096",
                                         "3E4001078696320014000000DC",
                                         "3E4401078A97320014000000DD",
                                         "3E44010285970097",
                                         "3E8C0101CC1010",
                                         "3E8C0101CC0101",
                                         "3E930100D2",
                                         "3E930100D2"};
  std::vector<std::string> lines;
  for (const std::string& data : talk) {
    lines.push_back("(1." + std::to_string(100000 + 300 * lines.size()) + ") u rs485#" + data);
  }
  const auto out = decode(lines, json_options(Generation::kV235, Series::kMs));
  Roles expected;
  for (std::size_t n = 0; n < talk.size(); ++n) expected.push_back(n % 2 == 0 ? "query" : "reply");
  EXPECT_EQ(roles(out), expected);
  for (std::size_t n = 0; n < talk.size(); ++n) {
    EXPECT_EQ(out[n].count("drawback"), 0U) << out[n];
    EXPECT_EQ(out[n]["frame"], lines[n].substr(lines[n].find("rs485#")));
  }
  EXPECT_EQ(out[2]["name"], "write setting to RAM");
  EXPECT_EQ(out[2]["values"]["kp"], 50);
  EXPECT_EQ(out[7]["values"]["ki"], 20);
  EXPECT_EQ(tally(out, 1, "42")["name"], "write setting to RAM");
  EXPECT_EQ(out.back()["buses"][0]["meaningless"], Json::object());
  EXPECT_EQ(out.back()["buses"][0]["commands_of_other_generations"], 0);
}

/// 48.72 V, and 100 at D[3:4]: V2.35 has the bus current there on RS-485, but not on CAN.
TEST(DecodeSerial, UsesRs485StateLayouts) {
  const auto out =
      decode({"(1.0) u rs485#3E9A0100D9", "(1.0003) u rs485#3E9A0107E024081364000000A3"},
             json_options(Generation::kV235));
  EXPECT_EQ(out[1]["values"]["voltage_V"], 48.72);
  EXPECT_EQ(out[1]["values"]["bus_current_A"], 1);
  EXPECT_EQ(out.back()["odd_states"], 0);
}

/// ID 65 would be 0x181 as an identifier, which CAN drives may use for replies.
TEST(DecodeSerial, DoesNotTakeIdsAbove32ForReplyIdentifiers) {
  const auto out =
      decode({"(1.0) a rs485#3E9A0100D9", "(1.0003) a rs485#3E9A410720240813000000003F",
              "(1.0004) a rs485#3E9A0107E0240813000000003F"},
             json_options(Generation::kV236));
  EXPECT_EQ(roles(out), (Roles{"query", "other", "reply"}));
}

/// One log with frames of both wires.
TEST(DecodeSerial, SeparatesCanAndRs485OfOneInterface) {
  const auto out =
      decode({"(1.0) a 141#9C00000000000000", "(1.0001) a rs485#3E9A0100D9",
              "(1.0003) a 141#9C19020003002108", "(1.0004) a rs485#3E9A0107E0240813000000003F"},
             json_options(Generation::kV236));
  EXPECT_EQ(roles(out), (Roles{"query", "query", "reply", "reply"}));
  EXPECT_EQ(out[3]["values"]["voltage_V"], 48.72);
}

/// docs/reference/protocol.md §10.1: the voltage of legacy is in [3:4], 0.1 V, that of v236 in
/// [2:3], 0.01 V.
TEST(Decode, ReadsDrivesOfARecordingByTheirOwnFirmware) {
  DecodeOptions options = json_options();
  ServoConfig servo;
  servo.id = 2;
  servo.profile = options.profile;
  servo.generation = Generation::kV236;
  servo.quirks = quirks_of(Generation::kV236);
  BusConfig bus;
  bus.interface = "a";
  bus.servos.push_back(servo);
  options.buses.push_back(bus);
  const std::vector<std::string> lines = {
      "(1.000000) a 141#9A00000000000000 T", "(1.000300) a 141#9A1900F000000000 R",
      "(1.001000) a 142#9A00000000000000 T", "(1.001300) a 142#9A19600900000000 R",
      "(1.002000) b 142#9A00000000000000 T", "(1.002300) b 142#9A1900F000000000 R"};
  const auto decoded = decode(lines, options);
  for (const std::size_t reply : {1U, 3U, 5U}) {
    EXPECT_EQ(decoded[reply]["values"]["voltage_V"], 24) << reply;
  }
  EXPECT_FALSE(decoded.back().contains("generation"));
  EXPECT_EQ(decoded.back()["odd_states"], 0);
  EXPECT_EQ(text(lines, options).find("assumed"), std::string::npos);
}

const std::vector<std::string> kTalk = {"(10.000000) a 141#9C00000000000000",
                                        "(10.000338) a 141#9C19020003002108"};

TEST(DecodeText, IsInBothLanguages) {
  DecodeOptions options = json_options();
  const std::string english = text(kTalk, options);
  EXPECT_NE(english.find("reply    0.338 ms  9C read state 2               temperature 25 °C, "
                         "iq 0.032 A, speed 3 °/s, encoder 2081\n"),
            std::string::npos)
      << english;
  options.language = Language::kChinese;
  const std::string chinese = text(kTalk, options);
  EXPECT_NE(chinese.find("9C 读取状态 2                 温度 25 °C，转矩电流 0.032 A，速度 3 °/s，"
                         "编码器位置 2081\n"),
            std::string::npos)
      << chinese;
  EXPECT_EQ(english.find('\x1b'), std::string::npos);
  options.colour = true;
  EXPECT_NE(text(kTalk, options).find('\x1b'), std::string::npos);
  // JSON is independent of the language.
  options.json = true;
  EXPECT_EQ(decode(kTalk, options), decode(kTalk));
}

TEST(DecodeText, EveryWordHasATranslation) {
  const auto known = [](std::string_view word) {
    return in_language(word, Language::kChinese) != word;
  };
  for (const auto rows : {protocol::commands(), protocol::serial_commands()}) {
    for (const auto& row : rows) EXPECT_TRUE(known(row.name)) << row.name;
  }
  for (const auto& row : protocol::multi_drive_commands()) EXPECT_TRUE(known(row.name)) << row.name;
  for (const std::string_view word : error_words(0xFF)) EXPECT_TRUE(known(word)) << word;
  for (const std::string_view word : error_frame_words(0x1FF)) EXPECT_TRUE(known(word)) << word;
  EXPECT_EQ(error_words(0xFF).size(), 8U);
}

// A field without a label would be printed with its key, "bus_current_A 1".
TEST(DecodeText, EveryFieldHasALabel) {
  for (const auto rows : {protocol::commands(), protocol::serial_commands()}) {
    for (const auto& command : rows) {
      for (const auto fields : {command.query, command.reply}) {
        for (const protocol::Field& field : fields) {
          const std::int64_t raw = field.values.empty() ? 1 : field.values.back().number;
          const double value = protocol::quantity(field, raw, protocol::kLegacyFormat);
          for (const Language language : {Language::kEnglish, Language::kChinese}) {
            const std::string said = quantities_text({{field.key, value}}, 0x9C, language);
            EXPECT_NE(said, std::string(field.key) + " " + three_decimals(value)) << command.name;
          }
        }
      }
    }
  }
}

/// 16 mA and 33/2048 A = 16.113 mA; with the motor's own scale 66/4096 A for both.
TEST(DecodeText, PrintsAssumptionsOnce) {
  DecodeOptions options = json_options();
  const std::string said = text(kTalk, options);
  const std::string note =
      "# assumed: firmware legacy (--generation), motor test (--motor); a count of iq is 16 mA in "
      "commands, 16.113 mA in replies\n";
  EXPECT_EQ(said.find(note), 0U) << said;
  EXPECT_EQ(said.find("assumed", note.size()), std::string::npos);
  options.motor_given = options.generation_given = true;
  EXPECT_EQ(text(kTalk, options).find("assumed"), std::string::npos);
  EXPECT_NE(text({"  a  141   [0] ", "  a  141   [0] "}, options).find("# no time stamps"),
            std::string::npos);
}

TEST(DecodeText, AlignsWideCharacters) {
  EXPECT_EQ(display_width("25 °C"), 5U);
  EXPECT_EQ(display_width("转矩，A"), 7U);
  EXPECT_EQ(padded("转矩", 6), "转矩  ");
  EXPECT_EQ(right("命令", 5), " 命令");
}

}  // namespace decode_test
}  // namespace lk::emulator
