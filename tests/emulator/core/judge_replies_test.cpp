// Verdicts on replies: which frames count as queries and replies, their number, age and contents;
// queries that are answered in time, late, or never.

#include <gtest/gtest.h>

#include "emulator/core/scenario/judge.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace judge_replies_test {

using namespace std::chrono_literals;

using Status = ExpectationResult::Status;

constexpr const char* kState1 = "141#9A00000000000000";
constexpr const char* kState2 = "141#9C00000000000000";

Period throughout(SimTime from, SimTime to) { return {Period::Kind::kThroughout, from, to}; }

BusConfig v236_bus(int id, bool multi_drive_mode) {
  BusConfig config = test::bus_config({});
  config.servos = {test::drive(Generation::kV236, Series::kMg, id)};
  config.servos[0].rom.broadcast_mode = multi_drive_mode;
  return config;
}

/// A judge of drive 1, whose queries and replies the test provides.
struct JudgedDrive {
  explicit JudgedDrive(const decltype(Expectation::what)& what, Period when = throughout(0ns, 10s),
                       SimTime start = 0ns)
      : judge(test::bus_config({1, 2}), {{0, 1, what, when, ""}}, 0, start) {}
  void query(SimTime when, const char* text) { judge.on_query({when, test::frame(text)}, bus); }
  void reply(SimTime when, const char* text) { judge.on_reply({when, test::frame(text)}); }
  ExpectationResult result(SimTime now = 10s) const { return judge.results(now).at(0); }
  Status status(SimTime now = 10s) const { return result(now).status; }
  Bus bus{test::bus_config({1, 2})};
  Judge judge;
};

TEST(JudgeReplies, CountOnlyTheirDriveAndCommand) {
  const Replies three{.command = 0x9C, .min_count = 2, .max_count = 2};
  JudgedDrive drive(three);
  drive.reply(1s, kState2);
  EXPECT_EQ(drive.status(2s), Status::kOpen);
  EXPECT_EQ(drive.status(), Status::kFailed);
  drive.reply(2s, "142#9C00000000000000");  // from another drive
  drive.reply(2s, kState1);                 // to another command
  drive.reply(2s, "00000141#9C00000000000000");
  EXPECT_EQ(drive.status(), Status::kFailed);
  drive.reply(3s, kState2);
  EXPECT_EQ(drive.status(5s), Status::kOpen) << "a third reply may come";
  EXPECT_EQ(drive.status(), Status::kPassed);
  drive.reply(4s, kState2);
  EXPECT_EQ(drive.status(5s), Status::kFailed) << "a reply too many fails at once";
}

TEST(JudgeReplies, PeriodIncludesItsEnds) {
  const Replies one{.min_count = 2, .max_count = 2};
  JudgedDrive drive(one, throughout(1s, 2s));
  drive.reply(1s - 1ns, kState2);
  drive.reply(2s + 1ns, kState2);
  EXPECT_EQ(drive.status(), Status::kFailed);
  drive.reply(1s, kState2);
  drive.reply(2s, kState2);
  EXPECT_EQ(drive.status(), Status::kPassed);
}

TEST(JudgeReplies, TimesCountFromTheStart) {
  Replies one;
  JudgedDrive drive(one, throughout(1s, 2s), 100s);
  drive.reply(1500ms, kState2);
  EXPECT_EQ(drive.status(103s), Status::kFailed);
  drive.reply(101500ms, kState2);
  EXPECT_EQ(drive.status(103s), Status::kPassed);
  EXPECT_EQ(drive.judge.results(103s).at(0).measured, "1 reply at 1.5 s");
}

TEST(JudgeReplies, ZeroRepliesCanBeExpected) {
  const Replies none{.command = 0x9C, .min_count = 0, .max_count = 0};
  JudgedDrive drive(none);
  EXPECT_EQ(drive.status(5s), Status::kOpen);
  EXPECT_EQ(drive.status(), Status::kPassed);
  drive.reply(1s, kState2);
  EXPECT_EQ(drive.status(5s), Status::kFailed);
}

TEST(JudgeReplies, AgeCountsFromTheLatestQueryOfTheCommand) {
  const Replies late{.command = 0x9C, .age = Range{5, 6}};
  JudgedDrive drive(late);
  drive.reply(0s, kState2);  // without a query
  drive.query(1000ms, kState2);
  drive.query(1003ms, kState1);
  drive.query(1003ms, "142#9C00000000000000");
  drive.reply(1005ms - 1ns, kState2);
  drive.reply(1006ms + 1ns, kState2);
  EXPECT_EQ(drive.status(), Status::kFailed);
  drive.reply(1005ms, kState2);
  EXPECT_EQ(drive.status(), Status::kPassed);
}

TEST(JudgeReplies, MultiDriveFrameQueriesEachDrive) {
  const BusConfig config = v236_bus(1, true);
  const Bus bus(config);
  const std::pair<const char*, std::uint8_t> queries[] = {{"280#0000000000000000", 0xA1},
                                                          {"281#0000000000000000", 0xA2},
                                                          {"282#0000000000000000", 0xA3},
                                                          {"288#9C009A0000000000", 0x9C}};
  for (const auto& [query, command] : queries) {
    const Replies prompt{.command = command, .age = Range{1, 2}};
    Judge judge(config, {{0, 1, prompt, throughout(0ns, 10s), ""}}, 0, 0ns);
    protocol::Frame reply = test::frame("141#0000000000000000");
    reply.data[0] = command;
    judge.on_reply({500ms, reply});  // without a query
    judge.on_query({1s, test::frame(query)}, bus);
    EXPECT_EQ(judge.results(10s).at(0).status, Status::kFailed) << query;
    judge.on_reply({1s + 1500us, reply});
    EXPECT_EQ(judge.results(10s).at(0).status, Status::kPassed) << query;
  }
}

TEST(JudgeReplies, IgnoredFrameIsNoQuery) {
  for (const bool several : {false, true}) {
    const BusConfig config = v236_bus(1, several);
    const Bus bus(config);
    const char* own = several ? "280#0000000000000000" : "141#A100000000000000";
    const char* others = several ? "141#A100000000000000" : "280#0000000000000000";
    const Replies slow{.command = 0xA1, .age = Range{5, 6}};
    Judge judge(config, {{0, 1, slow, throughout(0ns, 10s), ""}}, 0, 0ns);
    judge.on_query({1000ms, test::frame(own)}, bus);
    judge.on_query({1004ms, test::frame(others)}, bus);
    judge.on_reply({1005ms, test::frame("141#A100000000000000")});
    EXPECT_EQ(judge.results(10s).at(0).status, Status::kPassed) << several;
  }
}

TEST(JudgeReplies, MultiDriveFrameWithoutASlotIsNoQuery) {
  const BusConfig config = v236_bus(9, true);
  const Bus bus(config);
  const Replies prompt{.age = Range{0, 5}};
  // 0x288 addresses drives 1 to 8; half a frame addresses none.
  for (const char* query : {"288#9A9A9A9A9A9A9A9A", "280#0000"}) {
    Judge judge(config, {{0, 9, prompt, throughout(0ns, 10s), ""}}, 0, 0ns);
    judge.on_query({1s, test::frame(query)}, bus);
    for (const char* reply : {"149#9A00000000000000", "149#A100000000000000"}) {
      judge.on_reply({1001ms, test::frame(reply)});
    }
    EXPECT_EQ(judge.results(10s).at(0).status, Status::kFailed) << query;
  }
}

TEST(JudgeReplies, AreDecidedAtTheMinimumOrAboveTheMaximum) {
  const auto decided_at = [](std::uint64_t min_count, std::uint64_t max_count) {
    const Replies replies{.min_count = min_count, .max_count = max_count};
    JudgedDrive drive(replies);
    for (const SimTime when : {1s, 2s, 3s}) drive.reply(when, "141#9C19000000000000");
    return drive.judge.results(10s).at(0).decided_at;
  };
  constexpr auto kAny = std::numeric_limits<std::uint64_t>::max();
  EXPECT_EQ(decided_at(2, kAny), 2s);
  EXPECT_EQ(decided_at(1, 2), 3s);
  EXPECT_EQ(decided_at(3, 3), 10s);
  EXPECT_EQ(decided_at(4, kAny), 10s);
}

TEST(JudgeReplies, ErrorsAndFieldsAreRead) {
  // 0x9A by the manual: 25 °C, 24.0 V in 0.1 V, under-voltage is bit 0.
  const Replies error{.error = WhichError{model::Error::kUnderVoltage}};
  JudgedDrive set(error);
  set.reply(1s, "141#9A1900F000000000");
  EXPECT_EQ(set.status(), Status::kFailed);
  set.reply(1s, "141#9A1900F000000001");
  EXPECT_EQ(set.status(), Status::kPassed);

  const Replies voltage{.field = "voltage_V", .range = {23.95, 24.05}};
  JudgedDrive volts(voltage);
  volts.reply(1s, "141#9C19000000000000");  // contains no voltage
  volts.reply(1s, "141#9A1900EF00000000");
  EXPECT_EQ(volts.status(), Status::kFailed);
  volts.reply(1s, "141#9A1900F000000000");
  EXPECT_EQ(volts.status(), Status::kPassed);
}

TEST(JudgeReplies, OnlyDataFramesCountAsReplies) {
  JudgedDrive drive(Replies{});
  drive.reply(1s, "141#R8");
  EXPECT_EQ(drive.status(), Status::kFailed);
  drive.reply(1s, "141#");
  EXPECT_EQ(drive.status(), Status::kPassed);
}

TEST(JudgeReplies, TruncatedReplyHasNoFields) {
  const Replies any_voltage{.field = "voltage_V"};
  JudgedDrive drive(any_voltage);
  drive.reply(1s, "141#9A1900F0");  // truncated
  EXPECT_EQ(drive.status(), Status::kFailed);
  drive.reply(1s, "141#9A1900F000000000");
  EXPECT_EQ(drive.status(), Status::kPassed);
}

TEST(JudgeReplies, ReplyWithoutErrorBitsHasNoError) {
  const Replies error{.error = WhichError{model::Error::kUnderVoltage}};
  JudgedDrive drive(error);
  drive.reply(1s, "141#9C1901000000FFFF");  // state 2: these bytes are a current and an angle
  EXPECT_EQ(drive.status(), Status::kFailed);
}

TEST(JudgeReplies, MinimumAlonePassesAtOnce) {
  const Replies two{.min_count = 2};
  JudgedDrive drive(two);
  drive.reply(1s, kState2);
  EXPECT_EQ(drive.status(1s), Status::kOpen);
  drive.reply(2s, kState2);
  EXPECT_EQ(drive.status(2s), Status::kPassed);
}

/// An empty frame (wrong_dlc of 0) has no command.
TEST(JudgeReplies, OnlyReplyToAValidQueryHasAnAge) {
  const Replies prompt{.age = Range{1, 2}};
  const char* const zeros = "141#0000000000000000";
  for (const auto& [query, reply, status] :
       {std::tuple{zeros, zeros, Status::kPassed},
        {zeros, "141#", Status::kFailed},
        {"141#R8", zeros, Status::kFailed},
        {"141#", zeros, Status::kFailed},
        {"00000141#0000000000000000", zeros, Status::kFailed}}) {
    JudgedDrive drive(prompt);
    drive.query(1s, query);
    drive.reply(1001500us, reply);
    EXPECT_EQ(drive.status(), status) << query << ' ' << reply;
  }
  const Replies to_zero{.command = 0x00};
  JudgedDrive command(to_zero);
  command.reply(1s, "141#");
  EXPECT_EQ(command.status(), Status::kFailed);
}

// Bytes by hand from the tables of docs/reference/protocol.md; nullopt if the reply lacks the
// field.
TEST(JudgeReplies, FieldsFollowTheProtocol) {
  using protocol::kLegacyFormat;
  struct Case {
    const char* name;
    const char* text;
    std::optional<double> value;
  };
  const Case cases[] = {
      {"temperature_C", "141#9AF600F000000000", -10},           // state 1: int8 at [1]
      {"temperature_C", "141#9B2800F000000000", 40},            //
      {"temperature_C", "141#A12364000CFE3412", 35},            // state 2
      {"temperature_C", "141#9D23C0004CFFF4FF", 35},            // state 3
      {"temperature_C", "141#92A08C0000000000", std::nullopt},  //
      {"voltage_V", "141#9A1900F000000000", 24.0},              // 0.1 V at [3:4]
      {"voltage_V", "141#9C2364000CFE3412", std::nullopt},      //
      {"iq_A", "141#9C2300040CFE3412", 16.5},                   // 1024 of 33/2048 A
      {"iq_A", "141#9D23C0004CFFF4FF", std::nullopt},           //
      {"speed_dps", "141#9C2364000CFE3412", -500},              // int16 at [4:5]
      {"speed_dps", "141#9A1900F000000000", std::nullopt},      //
      {"encoder", "141#9C2364000CFE3412", 0x1234},              // at [6:7]
      {"encoder", "141#9000E803F83FF037", 1000},                // 0x90: at [2:3]
      {"encoder", "141#92A08C0000000000", std::nullopt},        //
      {"offset", "141#9000E803F83FF037", 0x37F0},               // at [6:7]
      {"offset", "141#9C2364000CFE3412", std::nullopt},         //
      {"angle_deg", "141#9260F0FFFFFFFFFF", -40},               // −4000 of 0.01°
      {"angle_deg", "141#940000000000A00F", 40},                // 4000 at [6:7]
      {"angle_deg", "141#9C2364000CFE3412", std::nullopt},      //
  };
  for (const Case& c : cases) {
    const auto value = protocol::reply_quantity(c.name, test::frame(c.text).data, kLegacyFormat);
    ASSERT_EQ(value.has_value(), c.value.has_value()) << c.name << ' ' << c.text;
    if (value) {
      EXPECT_DOUBLE_EQ(*value, *c.value) << c.name << ' ' << c.text;
    }
  }
}

using Status = ExpectationResult::Status;

// --- queries that must be answered

/// Queries must be answered within 20 ms.
JudgedDrive answered(std::optional<std::uint8_t> command = {}, Period when = throughout(0ns, 10s),
                     SimTime start = 0ns) {
  return JudgedDrive(Answered{command, 20ms}, when, start);
}

TEST(JudgeAnswers, ReplyAtTheLimitIsInTime) {
  JudgedDrive drive = answered();
  drive.query(1s, kState2);
  drive.reply(1020ms, kState2);
  EXPECT_EQ(drive.status(9s), Status::kOpen);
  EXPECT_EQ(drive.status(), Status::kPassed);
  EXPECT_EQ(drive.result().decided_at, 10s);
  EXPECT_EQ(drive.result().margin, std::nullopt);
}

TEST(JudgeAnswers, PassesWithoutAQuery) {
  EXPECT_EQ(answered().status(), Status::kPassed);
  JudgedDrive drive = answered();
  drive.query(1s, "142#9C00000000000000");  // of another drive
  drive.reply(2s, kState2);                 // without a query
  EXPECT_EQ(drive.status(), Status::kPassed);
}

// The host repeats an unanswered query: the waiting time starts at the first.
TEST(JudgeAnswers, RepeatedQueryDoesNotRestartTheLimit) {
  JudgedDrive late = answered();
  late.query(1s, kState2);
  late.query(1010ms, kState2);
  late.reply(1025ms, kState2);
  EXPECT_EQ(late.result().decided_at, 1020ms);
  JudgedDrive in_time = answered();
  in_time.query(1s, kState2);
  in_time.query(1010ms, kState2);
  in_time.reply(1015ms, kState2);
  EXPECT_EQ(in_time.status(), Status::kPassed);
}

TEST(JudgeAnswers, EachCommandNeedsItsOwnReply) {
  JudgedDrive drive = answered();
  drive.query(1s, kState2);
  drive.query(1005ms, kState1);
  drive.reply(1010ms, kState1);
  EXPECT_EQ(drive.status(1021ms), Status::kFailed);
  EXPECT_EQ(drive.result().decided_at, 1020ms);
  JudgedDrive both = answered();
  both.query(1s, kState2);
  both.query(1s, kState1);
  both.reply(1001ms, kState1);
  both.reply(1002ms, kState2);
  EXPECT_EQ(both.status(), Status::kPassed);
}

TEST(JudgeAnswers, OnlyTheNamedCommandCounts) {
  JudgedDrive drive = answered(0x9A);
  drive.query(1s, kState2);
  EXPECT_EQ(drive.status(), Status::kPassed);
  drive.query(2s, kState1);
  EXPECT_EQ(drive.result().decided_at, 2020ms);
}

TEST(JudgeAnswers, PeriodSelectsQueries) {
  const Period period{Period::Kind::kThroughout, 2s, 3s};
  const auto failed_at = [&](SimTime query) {
    JudgedDrive drive = answered(std::nullopt, period);
    drive.query(query, kState2);
    return drive.result().decided_at;
  };
  EXPECT_EQ(failed_at(2s - 1ns), 3s);  // passed: decided at the end
  EXPECT_EQ(failed_at(2s), 2020ms);
  EXPECT_EQ(failed_at(3s), 3020ms);  // queried in time; the wait may end later
  EXPECT_EQ(failed_at(3s + 1ns), 3s);
  JudgedDrive early = answered(std::nullopt, period);
  early.query(2s - 1ns, kState2);
  EXPECT_EQ(early.status(), Status::kPassed);
}

TEST(JudgeAnswers, FirstMissedReplyDecides) {
  JudgedDrive drive = answered();
  drive.query(1s, kState2);
  drive.reply(1030ms, kState2);
  drive.query(2s, kState1);
  EXPECT_EQ(drive.result(5s).decided_at, 1020ms);
}

// The host accepts only its own identifier and 8 bytes, so such a frame is not an answer.
TEST(JudgeAnswers, OtherIdOrLengthIsNoReply) {
  const auto after = [](const char* text) {
    JudgedDrive drive = answered();
    drive.query(1s, kState2);
    TimedFrame reply{1001ms, test::frame(text)};
    reply.drive_id = 1;
    drive.judge.on_reply(reply);
    return drive.status();
  };
  EXPECT_EQ(after(kState2), Status::kPassed);
  EXPECT_EQ(after("142#9C00000000000000"), Status::kFailed);
  EXPECT_EQ(after("741#9C00000000000000"), Status::kFailed);
  EXPECT_EQ(after("141#9C000000"), Status::kFailed);
  EXPECT_EQ(after("141#"), Status::kFailed);
  EXPECT_EQ(after(kState1), Status::kFailed);
}

/// Byte [7] of the replies of state 1 and 3 has the error bits.
TEST(JudgeAnswers, AnyErrorMatchesEachError) {
  const Replies replies{.error = WhichError{}};
  JudgedDrive drive(replies, {Period::Kind::kBy, 0ns, 10s});
  drive.reply(1s, "141#9A1900F000000000");
  EXPECT_EQ(drive.status(2s), Status::kOpen);
  drive.reply(3s, "141#9C1901000000FFFF");  // state 2 has no error bits
  EXPECT_EQ(drive.status(4s), Status::kOpen);
  EXPECT_EQ(drive.status(), Status::kFailed);
  drive.reply(5s, "141#9A1900F000000008");
  EXPECT_EQ(drive.status(6s), Status::kPassed);
  EXPECT_EQ(drive.result(6s).decided_at, 5s);
}

TEST(JudgeAnswers, LateOrMissingReplyFailsAtTheLimit) {
  for (const bool late : {true, false}) {
    JudgedDrive drive = answered({}, throughout(0ns, 10s), 100s);
    drive.query(101s, kState2);
    EXPECT_EQ(drive.status(101020ms - 1ns), Status::kOpen);
    if (late) drive.reply(101020ms + 1ns, kState2);
    EXPECT_EQ(drive.status(101020ms), Status::kFailed);
    EXPECT_EQ(drive.result(110s).decided_at, 1020ms);  // from the start of the scenario
    EXPECT_EQ(drive.result(110s).at, 1020ms);
  }
}

}  // namespace judge_replies_test
}  // namespace lk::emulator
