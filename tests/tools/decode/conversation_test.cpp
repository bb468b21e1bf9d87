// Senders of frames on a bus: queries and replies look alike, and logs begin anywhere. Lines as
// can-utils 2020.11 printed them on a real bus.

#include "tests/tools/decode/decode_support.hpp"

namespace lk::emulator {
namespace conversation_test {

TEST(Conversation, LeavesAmbiguousFirstFramesOpen) {
  // The first frame may be an echo of a query before the log; it looks like the second.
  const auto out = decode({"(1.0) a 141#8800000000000000", "(1.0003) a 141#8800000000000000",
                           "(1.3) a 141#8800000000000000"});
  EXPECT_EQ(roles(out), (Roles{"unclear", "unclear", "query"}));
  EXPECT_EQ(tally(out, 1, "88")["unclear"], 2);
  EXPECT_EQ(tally(out, 1, "88")["unanswered"], 0);
  // Only drives send states, even without a query in the log.
  const auto state = decode({"(1.0) a 141#9C19020003002108"});
  EXPECT_EQ(roles(state), (Roles{"reply"}));
  EXPECT_EQ(state[0]["sure"], false);
  EXPECT_EQ(state[0]["choices"], 0);
  EXPECT_EQ(tally(state, 1, "9C")["without_query"], 1);
}

TEST(Conversation, TakesEqualBytesForAnEchoOfARespondingDrive) {
  const auto out = decode({"(1.0) a 141#9C00000000000000", "(1.0003) a 141#9C19020003002108",
                           "(1.01) a 141#8100000000000000", "(1.0102) a 141#8100000000000000"});
  EXPECT_EQ(roles(out), (Roles{"query", "reply", "query", "reply"}));
  EXPECT_EQ(out[3]["sure"], false);
  EXPECT_NEAR(out[3]["latency_ms"].get<double>(), 0.2, 1e-6);
}

TEST(Conversation, FindsNoRepliesOfASilentDrive) {
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

TEST(Conversation, LostReplyDoesNotShiftOthers) {
  std::vector<std::string> lines = {"(1.000) a 141#9C00000000000000"};  // without a reply
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

TEST(Conversation, PairsRepliesInABatch) {
  const auto out = decode({"(1.000) a 141#9C00000000000000", "(1.001) a 141#9C00000000000000",
                           "(1.002) a 141#9C19020003002108", "(1.002) a 141#9C19020003002208"});
  const Json command = tally(out, 1, "9C");
  EXPECT_EQ(command["unanswered"], 0);
  EXPECT_EQ(command["latency_ms"]["count"], 2);
  EXPECT_NEAR(command["latency_ms"]["min"].get<double>(), 1, 1e-6);
  EXPECT_NEAR(command["latency_ms"]["max"].get<double>(), 2, 1e-6);
}

TEST(Conversation, DrivesAnswerInOrder) {
  const auto out = decode({"(1.0000) a 141#A200000064000000", "(1.0001) a 141#9C00000000000000",
                           "(1.0006) a 141#9C19020003002108"});
  EXPECT_EQ(tally(out, 1, "A2")["unanswered"], 1);
  EXPECT_NEAR(out[2]["latency_ms"].get<double>(), 0.5, 1e-6);
}

TEST(Conversation, DetectsReplyIdentifiers) {
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
  // Other devices use such identifiers too.
  EXPECT_EQ(roles(decode({"(1.0) a 181#8800000000000000"})), (Roles{"other"}));
}

/// docs/reference/protocol.md §8: the manual prints 0xA5 and 0xA6 in the replies to 0xA7 and 0xA8.
TEST(Conversation, AcceptsReplyBytesOfTheManual) {
  ServoConfig servo;
  servo.quirks.manual_reply_bytes = true;
  const ReplyReader reader(servo);
  EXPECT_TRUE(reader.answers_with(0x9B, 0x9A));
  EXPECT_TRUE(reader.answers_with(0xA7, 0xA5));
  EXPECT_TRUE(reader.answers_with(0xA8, 0xA6));
  EXPECT_FALSE(reader.answers_with(0xA7, 0xA3));
}

/// Another node's frame resembles a reply of this drive, which has no power.
TEST(Conversation, PrefersTheUsualReplyIdentifier) {
  const auto out = decode({"(1.0) a 141#9A00000000000000", "(1.01) a 181#9A19000000000000",
                           "(2.0) a 141#9C00000000000000", "(2.0003) a 141#9C19020003002108",
                           "(2.1) a 141#9C00000000000000", "(2.1003) a 141#9C19020003002108"});
  EXPECT_EQ(roles(out), (Roles{"query", "reply", "query", "reply", "query", "reply"}));
}

TEST(Conversation, UsesDirectionsIfBothOccur) {
  const auto out = decode({"(1.0) a 141#9200000000000000 T", "(1.0003) a 141#9211000000000000 R",
                           "(1.1) a 141#9200000000000000 T", "(1.1003) a 141#9200000000000000 R"});
  EXPECT_EQ(roles(out), (Roles{"query", "reply", "query", "reply"}));
  EXPECT_EQ(out[3]["sure"], true) << "exactly 0.00 deg";
}

TEST(Conversation, PairsMultiDriveCommands) {
  const auto out = decode({"(1.0) a 280#6400640064006400", "(1.0004) a 142#A119640000000008",
                           "(1.0006) a 143#A119640000000008", "(1.2) a 142#A119640000000008"});
  EXPECT_EQ(tally(out, 0, "280")["queries"], 1);
  EXPECT_NEAR(tally(out, 2, "280")["latency_ms"]["min"].get<double>(), 0.4, 1e-6);
  EXPECT_NEAR(tally(out, 3, "280")["latency_ms"]["min"].get<double>(), 0.6, 1e-6);
  EXPECT_EQ(tally(out, 2, "280")["unanswered"], 0);
  EXPECT_EQ(out[3]["choices"], 0);
  EXPECT_EQ(out.back()["buses"][0]["commands"].size(), 4U) << "nobody waits for drives 1 and 4";
}

TEST(Conversation, SeparatesInterfaces) {
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

TEST(Conversation, ReportsMalformedLinesOnce) {
  const auto out = decode({"(1.0) a 141#9C00000000000000", "nonsense", "more of it",
                           "(1.0003) a 141#9C19020003002108"});
  ASSERT_EQ(out.size(), 4U);
  EXPECT_EQ(out[1]["type"], "bad_line");
  EXPECT_EQ(out[1]["line"], 2);
  EXPECT_EQ(out[2]["line"], 4);
  EXPECT_EQ(out.back()["bad_lines"], 2);
}

/// As candump -t d, which looks like -t z until line 3; the query is 0.3 ms before its reply.
TEST(Conversation, CountsLatenciesOfStepsOnceDetected) {
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

TEST(Conversation, DecreasingTimesGiveNoLatency) {
  const auto out =
      decode({"(9.0) a 141#9C00000000000000", "(1.0) a 141#9C19020003002108",
              "(9000000000.0) a 141#9C00000000000000", "(0.1) a 141#9C19020003002108"});
  EXPECT_FALSE(tally(out, 1, "9C").contains("latency_ms"));
  EXPECT_EQ(out.back()["buses"][0]["duration_s"], 0);
}

}  // namespace conversation_test
}  // namespace lk::emulator
