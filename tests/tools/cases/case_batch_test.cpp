// Results of cases: what they say, and that they are the same however cases are computed.

#include "tools/cases/case_batch.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "emulator/monitor/scenario/scenario_runner.hpp"
#include "tests/tools/cases/cases_support.hpp"

namespace lk::test {
namespace case_batch_test {

class CaseBatch : public Cases {
 protected:
  /// The results of these cases, each computed alone.
  static std::map<std::uint64_t, std::string> alone(const std::vector<Json>& lines) {
    std::map<std::uint64_t, std::string> all;
    for (const Json& line : lines) all.merge(results({line}));
    return all;
  }
  /// One case for each kind of fault.
  std::vector<Json> of_every_kind() const {
    std::vector<Json> lines;
    for (const emulator::FaultRow& row : emulator::fault_table()) {
      const auto n = static_cast<double>(lines.size());
      const bool of_brake = row.word.starts_with("brake");
      Json more = fault(0.05 + 0.001 * n, fault_json(row), of_brake ? 2 : 1);
      if (row.of_bus) more["fault"].erase("id");
      more["drive_errors"] = {"any"};
      more["detect"] = Json::array({{{"id", 1}, {"answered", {{"within_s", 0.004}}}}});
      lines.push_back(one(lines.size(), more, row.serial ? "serial.toml" : "move.toml"));
    }
    return lines;
  }
};

TEST_F(CaseBatch, ResultsAreIndependentOfBatchingForEveryFault) {
  const std::vector<Json> lines = of_every_kind();
  const auto together = results(lines);
  ASSERT_EQ(together.size(), lines.size());
  EXPECT_EQ(alone(lines), together);
  for (const auto& [number, text] : together) {
    const Json result = Json::parse(text);
    ASSERT_TRUE(result.contains("fault")) << text;
    EXPECT_TRUE(result["fault"].contains("began_at_ns")) << lines[number];
  }
}

TEST_F(CaseBatch, IsIndependentOfOtherCasesAndOrder) {
  std::vector<Json> lines;
  std::mt19937 draw(24);
  const char* const kinds[] = {"silent", "jam", "drop", "hang"};
  for (std::uint64_t n = 0; n < 40; ++n) {
    Json more = fault(0.001 * static_cast<double>(draw() % 250), {{"kind", kinds[n % 4]}},
                      1 + static_cast<int>(draw() % 2));
    if (draw() % 3 == 0) more["seed"] = draw() % 2;
    if (draw() % 3 == 0) more["settings"] = {{"supply_V", 20 + draw() % 2}};
    if (draw() % 5 == 0) more["generation"] = "v235";
    if (draw() % 5 == 0) more.erase("fault");
    lines.push_back(one(n, more));
  }
  const auto together = results(lines);
  ASSERT_EQ(together.size(), lines.size());
  std::ranges::shuffle(lines, draw);
  std::map<std::uint64_t, std::string> in_pieces;
  for (std::size_t at = 0; at < lines.size();) {
    const std::size_t size = std::min<std::size_t>(1 + draw() % 13, lines.size() - at);
    in_pieces.merge(results({lines.begin() + static_cast<std::ptrdiff_t>(at),
                             lines.begin() + static_cast<std::ptrdiff_t>(at + size)}));
    at += size;
  }
  EXPECT_EQ(in_pieces, together);
}

TEST_F(CaseBatch, EqualsARunOfTheSameScenario) {
  for (const Json& line : of_every_kind()) {
    put("case.toml", emulator::CaseBuilder().file_text(emulator::read_case(line)));
    emulator::ScenarioRun run(emulator::load_scenario(path("case.toml"), std::nullopt));
    run.advance_to(std::chrono::milliseconds(250));
    std::vector<emulator::Traffic> traffic;
    run.take_traffic(traffic);
    emulator::TrafficWatch watch;
    watch.observe(traffic);
    const Json result = Cases::result(line);
    EXPECT_EQ(result["replies"], fmt::format("{:016x}", watch.reply_hash())) << line;
    const emulator::Verdict verdict = run.verdict();
    for (std::size_t n = 0; n < result["expect"].size(); ++n) {
      EXPECT_EQ(result["expect"][n]["measured"], verdict.expectations[n].measured) << line;
    }
    EXPECT_EQ(result.contains("invalid"), !verdict.invalid.empty()) << line;
  }
}

// The drive is asked for state 2 every 5 ms from 3 ms on: at 98, 103 and 108 ms.
TEST_F(CaseBatch, ReportsDetectionOfASilentDrive) {
  Json more = fault(0.1, {{"kind", "silent"}});
  more["detect"] = Json::array({{{"id", 1}, {"answered", {{"within_s", 0.004}}}}});
  const Json result = Cases::result(one(5, more));
  EXPECT_EQ(result["case"], 5);
  EXPECT_EQ(result["fault"]["began_at_ns"], 100'000'000);
  EXPECT_GT(result["fault"]["first_effect_at_ns"], 103'000'000);
  EXPECT_LT(result["fault"]["first_effect_at_ns"], 105'000'000);
  EXPECT_EQ(result["fault"]["effects"],
            33);  // replies from 103 to 248 ms, and at 104, 154 and 204 ms
  EXPECT_EQ(result["fault"]["state"], "running");
  EXPECT_EQ(result["fault"]["command"], "9C");  // state_2
  ASSERT_EQ(result["detect"].size(), 1U);
  EXPECT_EQ(result["detect"][0]["status"], "failed");
  EXPECT_EQ(result["detect"][0]["decided_at_ns"], 107'000'000);  // 4 ms after the query
  EXPECT_EQ(result["errors"], Json::array());
  EXPECT_FALSE(result.contains("invalid"));
}

TEST_F(CaseBatch, ReportsExpectations) {
  const Json result = Cases::result(one(1));
  EXPECT_FALSE(result.contains("fault"));
  ASSERT_EQ(result["expect"].size(), 2U);
  EXPECT_EQ(result["expect"][0]["says"], "drive 1 turns");
  EXPECT_EQ(result["expect"][0]["status"], "passed");
  EXPECT_GT(result["expect"][0]["margin"], 0);
  EXPECT_EQ(result["expect"][1]["says"], "drive 2 does not turn");
  EXPECT_EQ(result["expect"][1]["status"], "passed");
  EXPECT_EQ(result["expect"][1]["measured"], "0 to 0");
  EXPECT_EQ(result["expect"][1]["margin"], 0.5);  // of the range: at rest in its middle
}

// protection.under_voltage of the motor: 7 V.
TEST_F(CaseBatch, LowSupplyIsAnErrorOfEveryDrive) {
  const Json result = Cases::result(
      one(1, {{"settings", {{"supply_V", 6.8}}}, {"drive_errors", {"stall", "under_voltage"}}}));
  ASSERT_EQ(result["errors"].size(), 2U) << result;
  for (std::size_t n = 0; n < 2; ++n) {
    EXPECT_EQ(result["errors"][n]["bus"], "vcan0");
    EXPECT_EQ(result["errors"][n]["id"], n + 1);
    EXPECT_EQ(result["errors"][n]["error"], "under_voltage");
    EXPECT_GE(result["errors"][n]["at_ns"], 0);
  }
}

TEST_F(CaseBatch, FaultWithoutEffectMakesTheRunInvalid) {
  const Json result = Cases::result(one(1, fault(0.25, {{"kind", "silent"}})));
  ASSERT_EQ(result["invalid"].size(), 1U) << result;
  EXPECT_FALSE(result["fault"].contains("first_effect_at_ns"));
  EXPECT_EQ(result["fault"]["effects"], 0);
}

TEST_F(CaseBatch, ChecksWithoutRunning) {
  const Json result = Cases::result(one(3, fault(0.1, {{"kind", "jam"}})), true);
  const std::string inputs = result["inputs"];
  EXPECT_EQ(inputs.size(), 16U);
  EXPECT_EQ(result, (Json{{"case", 3},
                          {"inputs", inputs},
                          {"duration_s", 0.25},
                          {"drives",
                           {{{"bus", "vcan0"}, {"id", 1}, {"motor", "mg8016"}},
                            {{"bus", "vcan0"}, {"id", 2}, {"motor", "mg8016"}}}},
                          {"expect", {"drive 1 turns", "drive 2 does not turn"}}}));
  EXPECT_EQ(Cases::result(one(4, {{"seed", 9}}), true)["inputs"], inputs);
  put("can.toml", text_of("can.toml") + "# changed\n");
  EXPECT_NE(Cases::result(one(3), true)["inputs"], inputs);
}

TEST_F(CaseBatch, ImpossibleCaseDoesNotStopOthers) {
  const std::vector<Json> lines = {one(1), one(2, fault(0.1, {{"kind", "jam"}}, 9)), one(3)};
  for (const bool check : {false, true}) {
    std::vector<emulator::CaseRequest> requests;
    for (const Json& line : lines) requests.push_back(emulator::read_case(line));
    EXPECT_FALSE(emulator::CaseBatch().run(requests, check, [](const std::string&) {}));
    const auto all = results(lines, check);
    ASSERT_EQ(all.size(), 3U);
    EXPECT_EQ(Json::parse(all.at(2)),
              (Json{{"case", 2}, {"error", "case 2: fault.id: no drive 9 on this bus"}}));
    EXPECT_FALSE(Json::parse(all.at(1)).contains("error"));
    EXPECT_FALSE(Json::parse(all.at(3)).contains("error"));
  }
}

}  // namespace case_batch_test
}  // namespace lk::test
