// What is said on a bus, told from what candump prints. The lines are as can-utils 2020.11 printed
// them on a real bus; what the frames mean is worked out by hand from docs/protocol.md.

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "emulator/core/signals.hpp"
#include "emulator/decode/decode_words.hpp"
#include "emulator/decode/decoder.hpp"
#include "tests/support/frames.hpp"

namespace lk::emulator {
namespace {

using Json = nlohmann::json;
using namespace std::chrono_literals;

ShownFrame shown(std::string_view line) {
  const auto parsed = parse_candump_text(line);
  if (const auto* problem = std::get_if<std::string>(&parsed)) ADD_FAILURE() << line << *problem;
  const auto* frame = std::get_if<ShownFrame>(&parsed);
  return frame != nullptr ? *frame : ShownFrame{};
}

DecodeOptions json_options(Generation generation = Generation::kLegacy,
                           Series series = Series::kMf) {
  DecodeOptions options;
  options.generation = generation;
  options.profile.name = "test";
  options.profile.series = series;
  options.json = true;
  return options;
}

/// What comes out for the lines; the last is the summary.
std::vector<Json> decode(const std::vector<std::string>& lines,
                         const DecodeOptions& options = json_options()) {
  Decoder decoder(options);
  std::string out;
  for (const std::string& line : lines) out += decoder.take(line);
  out += decoder.finish();
  std::vector<Json> objects;
  for (std::size_t begin = 0; begin < out.size();) {
    const std::size_t end = out.find('\n', begin);
    objects.push_back(Json::parse(out.substr(begin, end - begin)));
    begin = end + 1;
  }
  return objects;
}

std::string text(const std::vector<std::string>& lines, DecodeOptions options) {
  options.json = false;
  Decoder decoder(options);
  std::string out;
  for (const std::string& line : lines) out += decoder.take(line);
  return out + decoder.finish();
}

std::vector<std::string> roles(const std::vector<Json>& objects) {
  std::vector<std::string> words;
  for (const Json& one : objects) {
    if (one["type"] == "frame") words.push_back(one["role"]);
  }
  return words;
}

/// Of the only interface, or the first.
Json tally(const std::vector<Json>& objects, int drive, std::string_view command) {
  for (const Json& one : objects.back()["buses"][0]["commands"]) {
    if (one["drive"] == drive && one["command"] == command) return one;
  }
  ADD_FAILURE() << "nothing of " << command;
  return {};
}

using Roles = std::vector<std::string>;

// --- what candump prints
// ------------------------------------------------------------------------------------

TEST(CandumpText, IsReadWhateverTheOptions) {
  const protocol::Frame frame = test::frame("142#9C19000003002108");
  for (const char* line :
       {"(1795303966.883131) vcan1 142#9C19000003002108",
        "(1795303972.149581) vcan1 142#9C19000003002108 T",
        "  vcan1  142   [8]  9C 19 00 00 03 00 21 08",
        "  vcan1  TX - -  142   [8]  9C 19 00 00 03 00 21 08",
        " (1795303992.513139)  vcan1  142   [8]  9C 19 00 00 03 00 21 08",
        " (000.041064)  vcan1  142   [8]  9C 19 00 00 03 00 21 08\r",
        " (2026-11-21 23:33:28.889034)  vcan1  142   [8]  9C 19 00 00 03 00 21 08",
        " (000.028241)  vcan1  RX B E  142   [8]  9C 19 00 00 03 00 21 08",
        "  vcan1  142   [8]  9C 19 00 00 03 00 21 08   '......!.'",
        "  vcan1  142   {B}  9C 19 00 00 03 00 21 08",
        "  \x1b[1m\x1b[31mvcan1\x1b[0m  142   [8]  9C 19 00 00 03 00 21 08",
        "  \x1b[1m\x1b[31mvcan1  142   [8]  9C 19 00 00 03 00 21 08\x1b[0m"}) {
    EXPECT_EQ(shown(line).line.frame, frame) << line;
    EXPECT_EQ(shown(line).line.interface, "vcan1") << line;
  }
}

TEST(CandumpText, HasStampsAndDirections) {
  EXPECT_EQ(shown(" (1795303992.513139)  a  142   [0] ").line.at, 1'795'303'992s + 513'139us);
  // 2026-11-21 is 20778 days after 1970-01-01.
  EXPECT_EQ(shown(" (2026-11-21 23:33:28.889034)  a  142   [0] ").line.at,
            20778 * 24h + 23h + 33min + 28s + 889'034us);
  EXPECT_FALSE(shown("  a  142   [0] ").has_stamp);
  EXPECT_EQ(shown("  a  RX - -  142   [0] ").line.direction, CandumpLine::Direction::kReceived);
  EXPECT_EQ(shown("  a  TX - -  142   [0] ").line.direction, CandumpLine::Direction::kSent);
  EXPECT_EQ(shown("  a  142   [0] ").line.direction, CandumpLine::Direction::kUnsaid);
}

TEST(CandumpText, HasEveryKindOfFrame) {
  using protocol::FrameKind;
  EXPECT_EQ(shown("  vcan0  141   [5]  remote request").line.frame.kind, FrameKind::kRemote);
  EXPECT_EQ(shown("  vcan0  141   [5]  remote request").line.frame.dlc, 5);
  EXPECT_EQ(shown("  vcan0  141   [0] ").line.frame.dlc, 0);
  EXPECT_TRUE(shown("  vcan0  1ABCDEF0   [2]  01 02").line.frame.extended);
  EXPECT_EQ(shown("  vcan0       141  [03]  9C 00 01").line.frame.kind, FrameKind::kFd);
  EXPECT_EQ(shown("(1.0) vcan0 141##59C0001").line.frame.kind, FrameKind::kFd);
  const auto error = shown("  can0  20000040   [8]  00 00 00 00 00 00 00 00   ERRORFRAME");
  EXPECT_EQ(error.line.frame.kind, FrameKind::kError);
  EXPECT_EQ(error.line.frame.id, 0x40U);
  // candump -e goes on about it on lines of their own.
  EXPECT_TRUE(std::holds_alternative<NothingShown>(parse_candump_text("\tbus-off")));
  EXPECT_TRUE(std::holds_alternative<NothingShown>(parse_candump_text("")));
}

TEST(CandumpText, RefusesEverythingElseInWordsThatAreSafeToPrint) {
  const std::string long_line = "(1.0) a 141##0" + std::string(5000, '0');
  for (const std::string& line :
       {std::string("hello"),
        std::string("("),
        std::string("()"),
        std::string("(1.0)"),
        std::string("(1.0) a"),
        std::string("(1.0) a 141"),
        std::string("(1.0) a 141#9"),
        std::string("(2026-13-41 99:99:99.000000)  a  141  [0]"),
        std::string("(2026-11-21 23:33:28.8890"),
        std::string("(99999999999999999999.0) a 141#"),
        std::string("a 141 [9] 00 00 00 00 00 00 00 00 00"),
        std::string("a 141 [8] 00"),
        std::string("a 141 [65]"),
        std::string("a 141 [-1]"),
        std::string("a 141 []"),
        std::string("a 141 ["),
        std::string("a 141 [1] 0"),
        std::string("a 141 [1] 00 00"),
        std::string("a 141 [1] GG"),
        std::string("a 141 [1] 00`00"),
        std::string("a FFF [0]"),
        std::string("a FFFFFFFFF [0]"),
        std::string("a  TX"),
        std::string("TX"),
        std::string("interface_of_16_b 141 [0]"),
        std::string("\x1b]0;title\a 141 [0]"),
        std::string("\x1b[2J 141 [0]"),
        std::string("a\0b 141 [0]", 11),
        std::string("a \xC2\x9B 141 [0]"),
        std::string("\xFF\xFE"),
        long_line,
        std::string("DROPCOUNT: dropped 5 CAN frames on 'a' socket (total drops 5)")}) {
    const auto parsed = parse_candump_text(line);
    const auto* problem = std::get_if<std::string>(&parsed);
    ASSERT_NE(problem, nullptr) << line;
    EXPECT_FALSE(problem->empty());
    EXPECT_LE(problem->size(), 200U);
    for (const char c : *problem) EXPECT_TRUE(c >= 0x20 && c <= 0x7E) << *problem;
  }
}

TEST(CandumpText, StepsAreToldFromTimesWhenOneIsBeforeTheLast) {
  StampReader stamps;
  EXPECT_EQ(stamps.time_of(shown(" (000.000000)  a  141   [0] ")), 0us);
  EXPECT_EQ(stamps.time_of(shown(" (000.000400)  a  141   [0] ")), 400us);
  EXPECT_FALSE(stamps.steps());
  EXPECT_EQ(stamps.time_of(shown(" (000.000300)  a  141   [0] ")), 700us);
  EXPECT_TRUE(stamps.steps());
  EXPECT_EQ(stamps.time_of(shown(" (000.001000)  a  141   [0] ")), 1700us);
  // Interfaces are read one after the other, so their times may cross.
  StampReader zero_based;
  EXPECT_EQ(zero_based.time_of(shown(" (000.000400)  a  141   [0] ")), 400us);
  EXPECT_EQ(zero_based.time_of(shown(" (000.000300)  b  141   [0] ")), 300us);
  EXPECT_FALSE(zero_based.steps());
}

// --- latencies
// ----------------------------------------------------------------------------------------------

TEST(LatencyHistogram, KeepsQuantilesInLittleRoom) {
  LatencyHistogram latency;
  EXPECT_EQ(latency.quantile(0.5), 0us);
  for (int us = 1; us <= 100'000; ++us) latency.add(std::chrono::microseconds(us));
  latency.add(-1us);
  EXPECT_EQ(latency.count(), 100'000U);
  EXPECT_EQ(latency.min(), 1us);
  EXPECT_EQ(latency.max(), 100ms);
  const auto near = [](SimTime is, double should_us) {
    return std::abs(static_cast<double>(is.count()) / 1000 - should_us) <= should_us / 64 + 0.5;
  };
  for (const double share : {0.0001, 0.01, 0.5, 0.9, 0.99, 0.999}) {
    EXPECT_TRUE(near(latency.quantile(share), share * 100'000))
        << share << " " << latency.quantile(share).count();
  }
  EXPECT_EQ(latency.quantile(0), 1us);
  LatencyHistogram one;
  one.add(338'200ns);
  EXPECT_EQ(one.quantile(0.5), 338'200ns);
  one.add(SimTime::max());
  EXPECT_EQ(one.max(), SimTime::max());
}

// --- what frames say
// ----------------------------------------------------------------------------------------

/// docs/protocol.md §2: iq of replies 33/2048 A in legacy; §10.2: 33/4096 A on MF from v235 on.
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

/// Lines of a drive that has shown how fast it is, and then of 0x81 at 50 Hz, each with its echo
/// after 0.3 ms, but for those that are `lost`.
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

/// The row of the summary about a command.
Json row_of(const std::vector<Json>& out, std::string_view command) {
  for (const Json& row : out.back()["buses"][0]["commands"]) {
    if (row["command"] == command) return row;
  }
  return nullptr;
}

TEST(Decode, TakesAnEchoThatIsMuchTooLateForTheQueryAgain) {
  const Json one_lost = row_of(decode(stops_with_echoes(20, {7})), "81");
  EXPECT_EQ(one_lost["queries"], 20) << one_lost;
  EXPECT_EQ(one_lost["replies"], 19);
  EXPECT_EQ(one_lost["unanswered"], 1);

  std::vector<int> all(20);
  std::iota(all.begin(), all.end(), 0);
  const Json dead = row_of(decode(stops_with_echoes(20, all)), "81");
  EXPECT_EQ(dead["queries"], 20) << dead;
  EXPECT_EQ(dead["replies"], 0);
  EXPECT_EQ(dead["unanswered"], 19) << "the log ends while the last waits";
}

/// Captures of real drives, docs/protocol.md §10.7.
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

TEST(Decode, SaysErrorsInWords) {
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
  // 0x04B0 = 1200 of 0.01 deg behind 0x012C = 300 dps, counter-clockwise; 0x64 = 100 of 16 mA.
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

/// §10.5: Max Torque Current in the LSB of 0xA1, which is 66/4096 A on MG; 0x320 = 800.
TEST(Decode, GivesParametersTheirUnits) {
  const auto out = decode({"(1.0) a 141#C11E000020030000", "(1.0003) a 141#C11E000020030000",
                           "(1.1) a 141#C020000000000000", "(1.1003) a 141#C0200000A08C0000"},
                          json_options(Generation::kV236, Series::kMg));
  EXPECT_EQ(out[0]["values"]["max_current_A"], 800 * 66.0 / 4096);
  EXPECT_EQ(out[3]["role"], "reply");
  EXPECT_EQ(out[3]["values"]["max_speed_dps"], 360);  // 0x8CA0 = 36000 of 0.01 dps
}

TEST(Decode, SaysWhyAFrameMeansNothing) {
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

/// §10.7: 48.72 V in 0.01 V at [2:3], which legacy drives leave 0 and 0.1 V at [3:4].
TEST(Decode, SaysWhenAStateLooksLikeAnotherGeneration) {
  const std::vector<std::string> lines = {
      "(1.0) a 141#9A00000000000000", "(1.0003) a 141#9A24081300000000",
      "(2.0) a 141#9A00000000000000", "(2.0003) a 141#9A24081300000000"};
  EXPECT_EQ(decode(lines).back()["odd_states"], 2);
  EXPECT_EQ(decode(lines, json_options(Generation::kV235)).back()["odd_states"], 0);
  const std::string said = text(lines, json_options());
  EXPECT_NE(said.find("does not look like the generation"), std::string::npos);
  EXPECT_EQ(said.find("does not look like"), said.rfind("does not look like")) << "said once";
  // 24.0 V of a legacy drive.
  EXPECT_EQ(decode({"(1.0) a 141#9A00000000000000", "(1.0003) a 141#9A1900F000000000"})
                .back()["odd_states"],
            0);
}

// --- who says it
// --------------------------------------------------------------------------------------------

TEST(Decode, DoesNotPretendToKnowWhereALogBeginsInTheMiddle) {
  // The first may be the echo of what came before the log; nothing tells the second from it.
  const auto out = decode({"(1.0) a 141#8800000000000000", "(1.0003) a 141#8800000000000000",
                           "(1.3) a 141#8800000000000000"});
  EXPECT_EQ(roles(out), (Roles{"unclear", "unclear", "query"}));
  EXPECT_EQ(tally(out, 1, "88")["unclear"], 2);
  EXPECT_EQ(tally(out, 1, "88")["unanswered"], 0);
  // A state is a drive's, though nobody asked for it here.
  const auto state = decode({"(1.0) a 141#9C19020003002108"});
  EXPECT_EQ(roles(state), (Roles{"reply"}));
  EXPECT_EQ(state[0]["sure"], false);
  EXPECT_EQ(state[0]["choices"], 0);
  EXPECT_EQ(tally(state, 1, "9C")["without_query"], 1);
}

TEST(Decode, TakesTheSameBytesForAnEchoOfADriveThatAnswers) {
  const auto out = decode({"(1.0) a 141#9C00000000000000", "(1.0003) a 141#9C19020003002108",
                           "(1.01) a 141#8100000000000000", "(1.0102) a 141#8100000000000000"});
  EXPECT_EQ(roles(out), (Roles{"query", "reply", "query", "reply"}));
  EXPECT_EQ(out[3]["sure"], false);
  EXPECT_NEAR(out[3]["latency_ms"].get<double>(), 0.2, 1e-6);
}

TEST(Decode, ASilentDriveIsNotHeardToAnswer) {
  std::vector<std::string> lines;
  for (int n = 0; n < 10; ++n) {
    lines.push_back("(1.00" + std::to_string(n) + ") a 141#9200000000000000");
  }
  for (const std::string& role : roles(decode(lines))) EXPECT_NE(role, "reply");
  std::vector<std::string> states;
  for (int n = 0; n < 5; ++n) {
    states.push_back("(" + std::to_string(n) + ".0) a 141#9C00000000000000");
  }
  const auto out = decode(states);
  EXPECT_EQ(roles(out), Roles(5, "query"));
  EXPECT_EQ(tally(out, 1, "9C")["unanswered"], 4);
  EXPECT_EQ(tally(out, 1, "9C")["open"], 1) << "the log ends before anybody can know";
  EXPECT_EQ(tally(out, 1, "9C")["rate_Hz"], 1.25) << "five in the four seconds of the log";
}

TEST(Decode, AReplyThatWasLostDoesNotShiftTheOthers) {
  std::vector<std::string> lines = {"(1.000) a 141#9C00000000000000"};  // lost
  for (int n = 1; n < 10; ++n) {
    lines.push_back("(1.00" + std::to_string(n) + "0) a 141#9C00000000000000");
    lines.push_back("(1.00" + std::to_string(n) + "3) a 141#9C19020003002108");
  }
  const auto out = decode(lines);
  EXPECT_EQ(out[2]["choices"], 2);
  EXPECT_FALSE(out[2].contains("latency_ms")) << "0.3 or 1.3 ms";
  EXPECT_NEAR(out[4]["latency_ms"].get<double>(), 0.3, 1e-6);
  const Json command = tally(out, 1, "9C");
  EXPECT_EQ(command["queries"], 10);
  EXPECT_EQ(command["replies"], 9);
  EXPECT_EQ(command["unanswered"], 1);
  EXPECT_EQ(command["latency_ms"]["count"], 9);
  EXPECT_NEAR(command["latency_ms"]["max"].get<double>(), 0.3, 1e-6);
}

TEST(Decode, RepliesInABatchFindTheirQueries) {
  const auto out = decode({"(1.000) a 141#9C00000000000000", "(1.001) a 141#9C00000000000000",
                           "(1.002) a 141#9C19020003002108", "(1.002) a 141#9C19020003002208"});
  const Json command = tally(out, 1, "9C");
  EXPECT_EQ(command["unanswered"], 0);
  EXPECT_EQ(command["latency_ms"]["count"], 2);
  EXPECT_NEAR(command["latency_ms"]["min"].get<double>(), 1, 1e-6);
  EXPECT_NEAR(command["latency_ms"]["max"].get<double>(), 2, 1e-6);
}

TEST(Decode, DrivesAnswerInOrder) {
  const auto out = decode({"(1.0000) a 141#A200000064000000", "(1.0001) a 141#9C00000000000000",
                           "(1.0006) a 141#9C19020003002108"});
  EXPECT_EQ(tally(out, 1, "A2")["unanswered"], 1);
  EXPECT_NEAR(out[2]["latency_ms"].get<double>(), 0.5, 1e-6);
}

TEST(Decode, TellsRepliesByTheirOwnIdentifier) {
  for (const char* const reply : {"181", "241"}) {
    const auto out = decode({"(1.0) a 141#8800000000000000",
                             std::string("(1.0003) a ") + reply + "#8800000000000000",
                             "(1.1) a 141#8800000000000000"});
    EXPECT_EQ(roles(out)[1], "reply") << reply;
    EXPECT_EQ(out[1]["sure"], true);
    EXPECT_EQ(out[1]["drive"], 1);
    EXPECT_EQ(roles(out)[2], "query");
    EXPECT_EQ(tally(out, 1, "88")["queries"], 2) << "the first was answered, so it was one";
  }
  // Others use such identifiers too.
  EXPECT_EQ(roles(decode({"(1.0) a 181#8800000000000000"})), (Roles{"other"}));
}

TEST(Decode, BelievesDirectionsOnceThereAreBoth) {
  const auto out = decode({"(1.0) a 141#9200000000000000 T", "(1.0003) a 141#9211000000000000 R",
                           "(1.1) a 141#9200000000000000 T", "(1.1003) a 141#9200000000000000 R"});
  EXPECT_EQ(roles(out), (Roles{"query", "reply", "query", "reply"}));
  EXPECT_EQ(out[3]["sure"], true) << "exactly 0.00 deg";
}

TEST(Decode, ACommandForSeveralDrivesIsAnsweredByThoseThatListen) {
  const auto out = decode({"(1.0) a 280#6400640064006400", "(1.0004) a 142#A119640000000008",
                           "(1.0006) a 143#A119640000000008", "(1.2) a 142#A119640000000008"});
  EXPECT_EQ(tally(out, 0, "280")["queries"], 1);
  EXPECT_NEAR(tally(out, 2, "280")["latency_ms"]["min"].get<double>(), 0.4, 1e-6);
  EXPECT_NEAR(tally(out, 3, "280")["latency_ms"]["min"].get<double>(), 0.6, 1e-6);
  EXPECT_EQ(tally(out, 2, "280")["unanswered"], 0);
  EXPECT_EQ(out[3]["choices"], 0);
  EXPECT_EQ(out.back()["buses"][0]["commands"].size(), 4U) << "nobody waits for drives 1 and 4";
}

TEST(Decode, TellsInterfacesApart) {
  const auto out = decode({"(1.0) a 141#9C00000000000000", "(1.0001) b 141#9C19020003002108",
                           "(1.0004) a 141#9C19020003002108"});
  EXPECT_EQ(out[1]["choices"], 0);
  EXPECT_EQ(out[2]["choices"], 1);
  EXPECT_EQ(out.back()["buses"].size(), 2U);
  std::vector<std::string> many;
  for (int n = 0; n < 40; ++n) many.push_back("(1.0) a" + std::to_string(n) + " 141#9C");
  EXPECT_EQ(decode(many).back()["buses"].size(), 32U);
  EXPECT_EQ(decode(many).back()["bad_lines"], 8);
}

TEST(Decode, LinesThatAreNoFramesAreSaidOnceAndCounted) {
  const auto out = decode({"(1.0) a 141#9C00000000000000", "nonsense", "more of it",
                           "(1.0003) a 141#9C19020003002108"});
  ASSERT_EQ(out.size(), 4U);
  EXPECT_EQ(out[1]["type"], "bad_line");
  EXPECT_EQ(out[1]["line"], 2);
  EXPECT_EQ(out[2]["line"], 4);
  EXPECT_EQ(out.back()["bad_lines"], 2);
}

/// candump -t d, which looks like -t z up to the third line; its query is 0.3 ms before its reply.
TEST(Decode, LatenciesOfStepsCountFromWhereTheyAreKnownToBeSteps) {
  const auto out = decode({" (000.000000)  a  141   [8]  92 00 00 00 00 00 00 00",
                           " (000.010000)  a  142   [8]  9C 00 00 00 00 00 00 00",
                           " (000.000200)  a  142   [8]  9C 19 02 00 03 00 21 08",
                           " (000.500000)  a  142   [8]  9C 00 00 00 00 00 00 00",
                           " (000.000300)  a  142   [8]  9C 19 02 00 03 00 21 08"});
  EXPECT_EQ(out[2], Json::parse(R"({"type":"stamps_are_steps","line":3})"));
  EXPECT_FALSE(out[3].contains("latency_ms"));
  EXPECT_NEAR(out[5]["latency_ms"].get<double>(), 0.3, 1e-6);
  EXPECT_NEAR(out[5]["time_s"].get<double>(), 0.5105, 1e-9);
  EXPECT_EQ(tally(out, 2, "9C")["latency_ms"]["count"], 1);
  EXPECT_EQ(tally(out, 2, "9C")["replies"], 2);
}

TEST(Decode, TimesThatGoBackMakeNoLatencies) {
  const auto out =
      decode({"(9.0) a 141#9C00000000000000", "(1.0) a 141#9C19020003002108",
              "(9000000000.0) a 141#9C00000000000000", "(0.1) a 141#9C19020003002108"});
  EXPECT_FALSE(tally(out, 1, "9C").contains("latency_ms"));
  EXPECT_EQ(out.back()["buses"][0]["duration_s"], 0);
}

// --- for people
// ---------------------------------------------------------------------------------------------

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
  // What programs read is the same in every language.
  options.json = true;
  EXPECT_EQ(decode(kTalk, options), decode(kTalk));
}

TEST(DecodeText, EveryWordIsThereInChinese) {
  const auto known = [](std::string_view word) {
    return in_language(word, Language::kChinese) != word;
  };
  for (const auto& row : protocol::kOpcodes) EXPECT_TRUE(known(row.name)) << row.name;
  for (const auto& row : protocol::kMultiDriveRows) EXPECT_TRUE(known(row.name)) << row.name;
  for (const std::string_view word : error_words(0xFF)) EXPECT_TRUE(known(word)) << word;
  for (const std::string_view word : error_frame_words(0x1FF)) EXPECT_TRUE(known(word)) << word;
  EXPECT_EQ(error_words(0xFF).size(), 8U);
}

/// 16 mA and 33/2048 A = 16.113 mA; with the motor's own scale 66/4096 A for both.
TEST(DecodeText, SaysWhatItAssumesOnce) {
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

}  // namespace
}  // namespace lk::emulator
