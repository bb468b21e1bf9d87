// Verdicts on queries that are answered in time, late, or never; and on any error.

#include <gtest/gtest.h>

#include "emulator/core/scenario/judge.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace judge_answers_test {

using namespace std::chrono_literals;
using Status = ExpectationResult::Status;

constexpr const char* kState2 = "141#9C00000000000000";
constexpr const char* kState1 = "141#9A00000000000000";

/// A judge of drive 1 with a manual wire: queries must be answered within 20 ms.
struct Ear {
  explicit Ear(std::optional<std::uint8_t> command = {},
               Period when = {Period::Kind::kThroughout, 0ns, 10s}, SimTime start = 0ns)
      : Ear(Answered{command, 20ms}, when, start) {}
  Ear(const decltype(Expectation::what)& what, Period when, SimTime start)
      : bus(test::bus_config({1, 2})),
        judge(test::bus_config({1, 2}), {{0, 1, what, when, ""}}, 0, start) {}
  void query(SimTime when, const char* text) { judge.on_query({when, test::frame(text)}, bus); }
  void reply(SimTime when, const char* text) { judge.on_reply({when, test::frame(text)}); }
  ExpectationResult result(SimTime now = 10s) const { return judge.results(now).at(0); }
  Status status(SimTime now = 10s) const { return result(now).status; }
  Bus bus;
  Judge judge;
};

TEST(JudgeAnswers, InTimeIsUpToTheLimit) {
  Ear ear;
  ear.query(1s, kState2);
  ear.reply(1020ms, kState2);
  EXPECT_EQ(ear.status(9s), Status::kOpen);
  EXPECT_EQ(ear.status(), Status::kPassed);
  EXPECT_EQ(ear.result().decided_at, 10s);
  EXPECT_EQ(ear.result().margin, std::nullopt);
}

TEST(JudgeAnswers, LateFailsAtTheLimitAndNotWhenItComes) {
  Ear ear;
  ear.query(1s, kState2);
  ear.reply(1020ms + 1ns, kState2);
  EXPECT_EQ(ear.status(2s), Status::kFailed);
  EXPECT_EQ(ear.result().decided_at, 1020ms);
  EXPECT_EQ(ear.result().at, 1020ms);
}

TEST(JudgeAnswers, NeverFailsOnceTheLimitIsOver) {
  Ear ear;
  ear.query(1s, kState2);
  EXPECT_EQ(ear.status(1020ms - 1ns), Status::kOpen);
  EXPECT_EQ(ear.status(1020ms), Status::kFailed);
  EXPECT_EQ(ear.result(10s).decided_at, 1020ms);
}

TEST(JudgeAnswers, NoQueryNeedsNoAnswer) {
  EXPECT_EQ(Ear().status(), Status::kPassed);
  Ear ear;
  ear.query(1s, "142#9C00000000000000");  // of another drive
  ear.reply(2s, kState2);                 // without a query
  EXPECT_EQ(ear.status(), Status::kPassed);
}

// The host repeats an unanswered query: the waiting time starts at the first.
TEST(JudgeAnswers, ASecondQueryDoesNotStartTheFirstAnew) {
  Ear late;
  late.query(1s, kState2);
  late.query(1010ms, kState2);
  late.reply(1025ms, kState2);
  EXPECT_EQ(late.result().decided_at, 1020ms);
  Ear in_time;
  in_time.query(1s, kState2);
  in_time.query(1010ms, kState2);
  in_time.reply(1015ms, kState2);
  EXPECT_EQ(in_time.status(), Status::kPassed);
}

TEST(JudgeAnswers, CommandsAreAnsweredEachByItsOwn) {
  Ear ear;
  ear.query(1s, kState2);
  ear.query(1005ms, kState1);
  ear.reply(1010ms, kState1);
  EXPECT_EQ(ear.status(1021ms), Status::kFailed);
  EXPECT_EQ(ear.result().decided_at, 1020ms);
  Ear both;
  both.query(1s, kState2);
  both.query(1s, kState1);
  both.reply(1001ms, kState1);
  both.reply(1002ms, kState2);
  EXPECT_EQ(both.status(), Status::kPassed);
}

TEST(JudgeAnswers, OnlyTheNamedCommandCounts) {
  Ear ear(0x9A);
  ear.query(1s, kState2);
  EXPECT_EQ(ear.status(), Status::kPassed);
  ear.query(2s, kState1);
  EXPECT_EQ(ear.result().decided_at, 2020ms);
}

TEST(JudgeAnswers, QueriesCountFromAndTo) {
  const Period period{Period::Kind::kThroughout, 2s, 3s};
  const auto failed_at = [&](SimTime query) {
    Ear ear(std::nullopt, period);
    ear.query(query, kState2);
    return ear.result().decided_at;
  };
  EXPECT_EQ(failed_at(2s - 1ns), 3s);  // passed: decided at the end
  EXPECT_EQ(failed_at(2s), 2020ms);
  EXPECT_EQ(failed_at(3s), 3020ms);  // queried in time; the wait may end later
  EXPECT_EQ(failed_at(3s + 1ns), 3s);
  Ear early(std::nullopt, period);
  early.query(2s - 1ns, kState2);
  EXPECT_EQ(early.status(), Status::kPassed);
}

TEST(JudgeAnswers, TimesCountFromTheScenariosBeginning) {
  Ear ear(std::nullopt, {Period::Kind::kThroughout, 0ns, 10s}, 100s);
  ear.query(101s, kState2);
  EXPECT_EQ(ear.status(101s), Status::kOpen);
  EXPECT_EQ(ear.result(102s).decided_at, 1020ms);
}

TEST(JudgeAnswers, TheFirstThatIsMissedDecides) {
  Ear ear;
  ear.query(1s, kState2);
  ear.reply(1030ms, kState2);
  ear.query(2s, kState1);
  EXPECT_EQ(ear.result(5s).decided_at, 1020ms);
}

// The host accepts only its own identifier and 8 bytes, so such a frame is not an answer.
TEST(JudgeAnswers, AFrameUnderAnotherIdOrOfAnotherLengthIsNone) {
  const auto after = [](const char* text) {
    Ear ear;
    ear.query(1s, kState2);
    TimedFrame reply{1001ms, test::frame(text)};
    reply.drive_id = 1;
    ear.judge.on_reply(reply);
    return ear.status();
  };
  EXPECT_EQ(after(kState2), Status::kPassed);
  EXPECT_EQ(after("142#9C00000000000000"), Status::kFailed);
  EXPECT_EQ(after("741#9C00000000000000"), Status::kFailed);
  EXPECT_EQ(after("141#9C000000"), Status::kFailed);
  EXPECT_EQ(after("141#"), Status::kFailed);
  EXPECT_EQ(after(kState1), Status::kFailed);
}

/// Byte [7] of the replies of state 1 and 3 has the error bits.
Ear any_error() {
  Replies replies;
  replies.error = WhichError{};
  return Ear(replies, {Period::Kind::kBy, 0ns, 10s}, 0ns);
}

TEST(JudgeAnswers, AnyErrorIsOneOfThem) {
  Ear ear = any_error();
  ear.reply(1s, "141#9A1900F000000000");
  EXPECT_EQ(ear.status(2s), Status::kOpen);
  ear.reply(3s, "141#9C1901000000FFFF");  // state 2 has no error bits
  EXPECT_EQ(ear.status(4s), Status::kOpen);
  EXPECT_EQ(ear.status(), Status::kFailed);
  ear.reply(5s, "141#9A1900F000000008");
  EXPECT_EQ(ear.status(6s), Status::kPassed);
  EXPECT_EQ(ear.result(6s).decided_at, 5s);
}

}  // namespace judge_answers_test
}  // namespace lk::emulator
