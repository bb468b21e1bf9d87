#include "tools/campaign/plan/plan_file.hpp"

#include <gtest/gtest.h>

#include "emulator/config/config_error.hpp"
#include "tests/tools/campaign/plan/plan_support.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kJam = "fault.kind = \"jam\"\nfault.id = 1\nfault.at_s = 1\n";

/// The key and the reason of what is wrong.
std::string problem(const std::string& sampling, const std::string& dimensions,
                    const std::string& rest = "") {
  try {
    plan_of(sampling, dimensions, rest);
  } catch (const ConfigError& wrong) {
    EXPECT_GT(wrong.line, 0) << wrong.what();
    return wrong.key + ": " + wrong.reason;
  }
  return "nothing";
}

TEST(PlanFile, ReadsBothWaysOfWritingADottedName) {
  const Plan one = plan_of("full", kJam);
  const Plan other =
      plan_of("full", "\"fault.kind\" = \"jam\"\n\"fault.id\" = 1\n\"fault.at_s\" = 1\n");
  EXPECT_EQ(one.head.dimensions, other.head.dimensions);
  EXPECT_NE(one.head.input_hash, other.head.input_hash);  // of what is written
}

TEST(PlanFile, RefusesWithTheReason) {
  EXPECT_EQ(problem("full", "fault.knd = \"jam\""),
            "dimension.fault.knd: unknown dimension, did you mean fault.kind?");
  EXPECT_EQ(problem("full", "fault.kind = []"), "dimension.fault.kind: is empty");
  EXPECT_EQ(problem("full", "fault.kind = \"jamm\""),
            "dimension.fault.kind: \"jamm\" is unknown, did you mean jam?");
  EXPECT_EQ(problem("random", std::string(kJam) + "supply_V = { from = 24, to = 24 }", "cases = 1"),
            "dimension.supply_V: the range is empty: to must be above from");
  EXPECT_EQ(problem("full", std::string(kJam) + "supply_V = { from = 20, to = 24 }"),
            "dimension: supply_V: sampling full needs a list, or a step in the range");
  EXPECT_EQ(problem("full", std::string(kJam) + "supply_V = 300"),
            "dimension.supply_V: 300 is out of range (0 to 100)");
  EXPECT_EQ(problem("random", kJam), "cases: missing");
  EXPECT_EQ(problem("full", kJam, "cases = 3"), "cases: belongs to random, latin and adaptive");
  EXPECT_EQ(problem("full", "fault.at_s = 1"), "dimension: fault.at_s needs fault.kind");
  EXPECT_EQ(problem("full", "fault.kind = \"encoder_jump\"\nfault.at_s = 1"),
            "dimension: \"fault.encoder_jump.angle_deg\" is required: give it a value, a list or a "
            "range");
  EXPECT_EQ(problem("full", std::string(kJam) + "fault.kick.impulse_Nms = 1"),
            "dimension: fault.kick.impulse_Nms: fault.kind never is kick");
  EXPECT_EQ(problem("full", std::string(kJam) + "supply_V = { from = 20, to = 24, sep = 1 }"),
            "dimension.supply_V: unknown key sep; known are from, to, step, log, mean, sd, values, "
            "weights, least");
  EXPECT_EQ(problem("full", kJam, "[hazard]\nexpectations = [\"none such\"]"),
            "hazard.expectations: the scenario expects nothing that says \"none such\"");
  EXPECT_EQ(problem("full", kJam, "[[detect.host]]\nsays = \"(\"").substr(0, 43),
            "detect.host.says: \"(\" is no regular express");
}

TEST(PlanFile, RefusesExclusionsThatMeanSomethingElse) {
  const auto excluding = [](const std::string& what) {
    return problem("random", std::string(kJam) + "supply_V = { from = 20, to = 24 }",
                   "cases = 1\n[[exclude]]\n" + what + "\n");
  };
  EXPECT_EQ(excluding("supply_V = { from = 21, too = 22 }"),
            "exclude.supply_V: unknown key too; known are from, to");
  EXPECT_EQ(excluding("supply_V = { from = 22, to = 21 }"),
            "exclude.supply_V: the range is empty: to is below from");
  EXPECT_EQ(excluding("fault.kind = { from = 1 }"),
            "exclude.fault.kind: has words, and no range: give one or a list");
  EXPECT_EQ(excluding("supply_V = { from = 23 }"), "nothing");
}

TEST(PlanFile, KnowsWhichFaultsADriveCanHave) {
  const Plan plan =
      plan_of("random", "fault.kind = { values = [\"jam\"], weights = [1] }\nfault.at_s = 1\n",
              "cases = 1");
  EXPECT_EQ(plan.head.dimensions[0].words, std::vector<std::string>{"jam"});
}

}  // namespace
}  // namespace lk::emulator
