// Cases come out the same, however they are computed; and as physics and the drive's settings say.

#include "tools/campaign/run/offline.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <set>

#include "tests/tools/campaign/run/run_support.hpp"

namespace lk::test {
namespace offline_test {

using namespace std::chrono_literals;
using emulator::CaseOutcome;
using emulator::CaseResult;
using emulator::CaseToRun;
using emulator::OfflineRunner;
using emulator::Plan;
using Texts = std::vector<std::string>;

/// The first case of each kind of fault.
std::vector<CaseToRun> one_of_each_kind(const Plan& plan) {
  std::set<std::string> kinds;
  std::vector<CaseToRun> cases;
  const emulator::CaseNumbers numbers(plan);
  for (std::uint64_t n = 0; n < 600; ++n) {
    const auto values = *numbers.values(n);
    if (kinds.insert(std::get<std::string>(*values.front())).second)
      cases.push_back({n, 0, values});
  }
  return cases;
}

TEST(Offline, SharesWithoutATraceUnderEveryFault) {
  const Plan plan = emulator::load_plan("every_fault");
  ASSERT_EQ(plan.dimensions.front().target, emulator::Target::kFaultKind);
  const std::vector<CaseToRun> cases = one_of_each_kind(plan);
  ASSERT_EQ(cases.size(), plan.dimensions.front().values.size());
  const Texts alone = texts_of(OfflineRunner(plan, {false, false}).run(cases));
  EXPECT_EQ(texts_of(OfflineRunner(plan, {true, false}).run(cases)), alone);
  EXPECT_EQ(texts_of(OfflineRunner(plan, {false, true}).run(cases)), alone);
  EXPECT_EQ(texts_of(OfflineRunner(plan, {true, true}).run(cases)), alone);
}

constexpr const char* kVaried = R"(
fault.kind = ["silent", "jam", "load_step", "drop", "kick", "hang"]
fault.id = 1
fault.at_s = { from = 0, to = 0.9 }
fault.for_s = [0.05, 0.3]
fault.jam.percent = { from = 20, to = 100 }
fault.load_step.torque_Nm = { from = 0.5, to = 10 }
fault.kick.impulse_Nms = { from = 0.05, to = 1 }
supply_V = [20, 24]
ambient_C = { from = 0, to = 40 }
load.J_g_cm2 = [200000, 400000]
seed = [1, 2]
generation = ["v235", "v236", "legacy"]
bus_load = [0, 0.3]
)";

TEST(Offline, DoesNotDependOnCompany) {
  const Plan plan = plan_of("short_move.toml", kVaried, "sampling = \"random\"\ncases = 48");
  std::vector<std::uint64_t> numbers(48);
  std::iota(numbers.begin(), numbers.end(), 0);
  const std::vector<CaseToRun> cases = cases_of(plan, numbers);
  OfflineRunner one_runner(plan);
  const Texts together = texts_of(one_runner.run(cases));
  std::mt19937 draw(24);
  for (int round = 0; round < 3; ++round) {
    std::vector<CaseToRun> shuffled = cases;
    std::ranges::shuffle(shuffled, draw);
    Texts texts(cases.size());
    OfflineRunner runner(plan, {round != 1, round != 2});
    for (std::size_t at = 0; at < shuffled.size();) {
      const std::size_t size = std::min(1 + draw() % 13, shuffled.size() - at);
      for (const CaseResult& one : runner.run(std::span(shuffled).subspan(at, size))) {
        texts[one.number] = canonical_line(one);
      }
      at += size;
    }
    EXPECT_EQ(texts, together) << round;
  }
  EXPECT_EQ(texts_of(one_runner.run(cases)), together) << "again";
}

TEST(Offline, HandsOverEightAtATimeAndStopsThen) {
  const Plan plan = plan_of("short_move.toml",
                            "fault.kind = \"silent\"\nfault.id = 1\n"
                            "fault.at_s = { from = 0.1, to = 0.9 }\nfault.for_s = 0.1\n",
                            "sampling = \"random\"\ncases = 20");
  std::vector<std::uint64_t> numbers(20);
  std::iota(numbers.begin(), numbers.end(), 0);
  const std::vector<CaseToRun> cases = cases_of(plan, numbers);
  std::vector<std::size_t> sizes;
  const auto run = [&](std::size_t most) {
    sizes.clear();
    OfflineRunner(plan).run(cases, [&](std::vector<CaseResult> some) {
      sizes.push_back(some.size());
      return sizes.size() < most;
    });
  };
  run(100);
  EXPECT_EQ(sizes, (std::vector<std::size_t>{8, 8, 4}));
  run(1);
  EXPECT_EQ(sizes, std::vector<std::size_t>{8});
}

TEST(Offline, RunsNothingOfNothing) {
  const Plan plan =
      plan_of("joint_moves", "fault.kind = \"silent\"\nfault.at_s = 1\n", "sampling = \"full\"");
  EXPECT_TRUE(OfflineRunner(plan).run({}).empty());
}

/// The only case of a plan on the moving joint, whose host asks fifty times a second.
CaseResult only_case(const std::string& fault, const std::string& rest = "",
                     const std::string& scenario = "joint_moves") {
  const Plan plan = plan_of(scenario, fault, "sampling = \"full\"\n" + rest);
  const auto results = OfflineRunner(plan).run(cases_of(plan, {0}));
  if (results.size() != 1) throw std::runtime_error("not one case");
  return results.front();
}

constexpr const char* kAnswered = R"(
[detect]
drive = "any"
[[detect.host]]
id = 1
answered = { within_s = 0.02 }
)";

// The host asks state 2 every 20 ms, and more now and then: the first query that is not answered
// comes within 20 ms, and 20 ms later the host knows.
TEST(Physics, ASilentDriveIsNoticedWithinTwoQueries) {
  const CaseResult result =
      only_case("fault.kind = \"silent\"\nfault.id = 1\nfault.at_s = 1.003\n", kAnswered);
  EXPECT_EQ(result.outcome, CaseOutcome::kDetectedByHost);
  EXPECT_EQ(result.fault_at, 1003ms);
  ASSERT_TRUE(result.detected_by_host);
  EXPECT_GE(*result.detected_by_host, 1023ms);
  EXPECT_LE(*result.detected_by_host, 1043ms);
  EXPECT_EQ(result.detected_by_drive, std::nullopt);
  EXPECT_EQ(result.state, "running");
}

// protection.stall of robots/joint.toml: 0.3 s at the limit of the current, to which the speed loop
// has to climb first.
TEST(Physics, AFullJamIsNoticedByTheDriveAfterItsThreshold) {
  const CaseResult result =
      only_case("fault.kind = \"jam\"\nfault.id = 1\nfault.at_s = 1\nfault.jam.percent = 100\n");
  ASSERT_TRUE(result.detected_by_drive);
  EXPECT_GE(*result.detected_by_drive, 1300ms);
  EXPECT_LE(*result.detected_by_drive, 1600ms);
  EXPECT_EQ(result.detected_by_host, std::nullopt);
  EXPECT_EQ(result.violated, "the forearm is up in time");
}

// J = 0.03 kg m² at the output: 1 Nms is more than 60°/s by far, whatever the rotor adds.
TEST(Physics, AKickViolatesASpeedLimitAtOnce) {
  const CaseResult result = only_case(
      "fault.kind = \"kick\"\nfault.id = 1\nfault.at_s = 2.2\nfault.kick.impulse_Nms = 1\n");
  EXPECT_EQ(result.violated, "it never moves faster than 60 degrees a second");
  ASSERT_TRUE(result.violated_at);
  EXPECT_GE(*result.violated_at, 2200ms);
  EXPECT_LE(*result.violated_at, 2202ms);  // it is looked at every ms
  ASSERT_TRUE(result.margin);
  EXPECT_LT(*result.margin, 0);
}

// A fault that begins when all is over, or of frames that are not there, says nothing.
TEST(Physics, WhatHasNoEffectHasNotFired) {
  const CaseResult at_end = only_case("fault.kind = \"silent\"\nfault.id = 1\nfault.at_s = 5\n");
  EXPECT_EQ(at_end.outcome, CaseOutcome::kNotFired);
  const CaseResult before =  // the host asks from 0.05 s
      only_case("fault.kind = \"silent\"\nfault.id = 1\nfault.at_s = 0\nfault.for_s = 0.04\n");
  EXPECT_EQ(before.outcome, CaseOutcome::kNotFired);
  EXPECT_EQ(before.command, "none");
}

TEST(Physics, CommandIsTheLatestTheDriveHasHeard) {
  // position_2 (0xA4) at 0.1 s; then every 20 ms state 2 (0x9C); at 0.06 s state 1 (0x9A).
  const auto command_at = [](const char* at) {
    return only_case("fault.kind = \"silent\"\nfault.id = 1\nfault.at_s = " + std::string(at) +
                     "\n")
        .command;
  };
  EXPECT_EQ(command_at("0.055"), "9C");
  EXPECT_EQ(command_at("0.065"), "9A");
  EXPECT_EQ(command_at("0.105"), "A4");
}

}  // namespace offline_test
}  // namespace lk::test
