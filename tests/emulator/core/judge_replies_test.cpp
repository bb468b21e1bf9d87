// Which frames count as queries and replies, and their contents.

#include <gtest/gtest.h>

#include "emulator/core/scenario/judge.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace judge_replies_test {

using namespace std::chrono_literals;
using Status = ExpectationResult::Status;

/// A judge of drive 1 from 0 to 10 s with a manual wire.
struct Ear {
  explicit Ear(const Replies& replies, const BusConfig& config = test::bus_config({1}))
      : bus(config),
        judge(config, {{0, 1, replies, {Period::Kind::kThroughout, 0ns, 10s}, ""}}, 0, 0ns) {}
  void query(SimTime when, const protocol::Frame& frame) { judge.on_query({when, frame}, bus); }
  void query(SimTime when, const char* text) { query(when, test::frame(text)); }
  void reply(SimTime when, const char* text) { judge.on_reply({when, test::frame(text)}); }
  Status status(SimTime now = 10s) const { return judge.results(now).at(0).status; }
  Bus bus;
  Judge judge;
};

TEST(JudgeReplies, OnlyADataFrameOfElevenBitsAsks) {
  Replies prompt;
  prompt.age = Range{1, 2};
  for (const char* text : {"141#R8", "00000141#0000000000000000", "141#"}) {
    Ear ear(prompt);
    ear.query(1s, text);
    ear.reply(1001500us, "141#0000000000000000");
    EXPECT_EQ(ear.status(), Status::kFailed) << text;
  }
  Ear ear(prompt);
  ear.query(1s, "141#0000000000000000");
  ear.reply(1001500us, "141#0000000000000000");
  EXPECT_EQ(ear.status(), Status::kPassed);
}

TEST(JudgeReplies, OnlyADataFrameReplies) {
  Ear ear(Replies{});
  ear.reply(1s, "141#R8");
  EXPECT_EQ(ear.status(), Status::kFailed);
  ear.reply(1s, "141#");
  EXPECT_EQ(ear.status(), Status::kPassed);
}

// A wrong_dlc of 0 gives a frame without a command.
TEST(JudgeReplies, AnEmptyReplyIsToNoCommand) {
  Replies to_zero;
  to_zero.command = 0x00;
  Ear command(to_zero);
  command.reply(1s, "141#");
  EXPECT_EQ(command.status(), Status::kFailed);

  Replies prompt;
  prompt.age = Range{1, 2};
  Ear age(prompt);
  age.query(1s, "141#0000000000000000");
  age.reply(1001500us, "141#");
  EXPECT_EQ(age.status(), Status::kFailed);
}

TEST(JudgeReplies, WhatCannotBeReadSaysNothing) {
  Replies any_voltage;
  any_voltage.field = "voltage_V";
  Ear ear(any_voltage);
  ear.reply(1s, "141#9A1900F0");  // truncated
  EXPECT_EQ(ear.status(), Status::kFailed);
  ear.reply(1s, "141#9A1900F000000000");
  EXPECT_EQ(ear.status(), Status::kPassed);
}

TEST(JudgeReplies, AReplyWithoutErrorBitsHasNoneSet) {
  Replies error;
  error.error = WhichError{model::Error::kUnderVoltage};
  Ear ear(error);
  ear.reply(1s, "141#9C1901000000FFFF");  // state 2: these bytes are a current and an angle
  EXPECT_EQ(ear.status(), Status::kFailed);
}

TEST(JudgeReplies, EnoughIsEnoughWhereThereIsNoMost) {
  Replies two;
  two.min_count = 2;
  Ear ear(two);
  ear.reply(1s, "141#9C00000000000000");
  EXPECT_EQ(ear.status(1s), Status::kOpen);
  ear.reply(2s, "141#9C00000000000000");
  EXPECT_EQ(ear.status(2s), Status::kPassed);
}

// Bytes by hand from the tables of docs/reference/protocol.md; nullopt if the reply lacks the
// field.
TEST(JudgeReplies, FieldsAreThoseOfTheProtocol) {
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

}  // namespace judge_replies_test
}  // namespace lk::emulator
