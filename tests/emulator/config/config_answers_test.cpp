// Scenario files: features made for campaigns, i.e. answers in time, any error, another generation.

#include <gtest/gtest.h>

#include "emulator/core/scenario/scenario_text.hpp"
#include "tests/emulator/config/config_scenario_support.hpp"

namespace lk::emulator {
namespace config_answers_test {

using namespace std::chrono_literals;

Expectation read(const std::string& expect) {
  return parse_scenario(kHead + std::string("[[expect]]\n") + expect, "k.toml", std::nullopt,
                        kFiles)
      .expectations.at(0);
}

TEST(ScenarioFile, ReadsAnsweredExpectations) {
  const Expectation any = read("id = 1\nanswered = { within_s = 0.02 }");
  EXPECT_EQ(std::get<Answered>(any.what).within, 20ms);
  EXPECT_EQ(std::get<Answered>(any.what).command, std::nullopt);
  EXPECT_EQ(any.when.kind, Period::Kind::kThroughout);
  EXPECT_EQ(any.when.from, 0s);
  EXPECT_EQ(any.when.to, 10s);
  EXPECT_EQ(expectation_text(any, "vcan0"),
            "vcan0 drive 1: each query answered within 0.02 s from 0 s to 10 s");
  const Expectation one =
      read("id = 1\nanswered = { command = \"state_2\", within_s = 1 }\nfrom_s = 2\nto_s = 3");
  EXPECT_EQ(std::get<Answered>(one.what).command, 0x9C);
  EXPECT_EQ(one.when.from, 2s);
  EXPECT_EQ(one.when.to, 3s);
}

TEST(ScenarioFile, RejectsMalformedAnswered) {
  EXPECT_EQ(expect_mistake("id = 1\nanswered = { command = 0x9C }"),
            "k.toml:5: expect.answered.within_s: missing");
  EXPECT_NE(expect_mistake("id = 1\nanswered = { within_s = -1 }").find("answered.within_s"),
            std::string::npos);
  EXPECT_NE(expect_mistake("id = 1\nanswered = { within_s = 1, error = \"any\" }")
                .find("answered.error: unknown key"),
            std::string::npos);
  EXPECT_EQ(expect_mistake("id = 1\nanswered = { within_s = 1 }\nat_s = 1"),
            "k.toml:6: expect.at_s: replies take a while: use from_s and to_s, or by_s");
  EXPECT_EQ(expect_mistake("id = 1\nreply = {}\nanswered = { within_s = 1 }"),
            "k.toml:6: expect.answered: only one of signal, error, state, reply, no_reply and "
            "answered; this expectation has reply already");
}

TEST(ScenarioFile, ReadsExpectationsOfAnyError) {
  const Expectation bit = read("id = 1\nerror = \"any\"\nfrom_s = 0\nby_s = 2");
  EXPECT_EQ(std::get<ErrorIs>(bit.what).error.one, std::nullopt);
  EXPECT_TRUE(std::get<ErrorIs>(bit.what).set);
  const Expectation none = read("id = 1\nerror = \"any\"\nset = false\nfrom_s = 0");
  EXPECT_FALSE(std::get<ErrorIs>(none.what).set);
  const Replies reply = std::get<Replies>(read("id = 1\nreply = { error = \"any\" }").what);
  ASSERT_TRUE(reply.error);
  EXPECT_EQ(reply.error->one, std::nullopt);
  const Replies stall = std::get<Replies>(read("id = 1\nreply = { error = \"stall\" }").what);
  EXPECT_EQ(stall.error->one, model::Error::kStall);
  EXPECT_FALSE(std::get<Replies>(read("id = 1\nreply = {}").what).error);
}

// Applies to all drives, also those whose generation the robot's file sets.
TEST(ScenarioFile, SetsTheGenerationOfItsDrives) {
  const Scenario scenario = parsed("generation = \"late-legacy\"\n");
  for (const BusConfig& bus : scenario.robot) {
    for (const ServoConfig& servo : bus.servos) {
      EXPECT_EQ(servo.generation, Generation::kLateLegacy) << bus.interface << ' ' << servo.id;
    }
  }
  EXPECT_EQ(parsed("").robot[0].servos[1].generation, Generation::kV236);
  EXPECT_NE(mistake("generation = \"v999\"\n").find("dir/kick.toml:3: generation: "),
            std::string::npos);
}

}  // namespace config_answers_test
}  // namespace lk::emulator
