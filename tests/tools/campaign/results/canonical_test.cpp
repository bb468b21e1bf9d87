#include "tools/campaign/results/canonical.hpp"

#include <gtest/gtest.h>

#include "tests/tools/campaign/results/campaign_files.hpp"

namespace lk::test {
namespace {

TEST(Canonical, NamesItsColumns) {
  auto head = synthetic_head(1);
  head.dimensions[0].name = "host.a,b";
  EXPECT_EQ(emulator::canonical_header(head),
            "number,\"host.a,b\",fault.at_s,fault.for_s,fault.jam.percent,generation,outcome,"
            "adaptive_generation,fault_at_ns,first_effect_at_ns,detected_by_drive_ns,"
            "detected_by_host_ns,violated_at_ns,violated,margin,state,command,note,real_time,runs,"
            "flips\n");
}

TEST(Canonical, IsALineACase) {
  emulator::CaseResult one;
  one.number = 4711;
  one.values = {"jam", 0.1, 1e21, std::nullopt, "gen2"};
  one.outcome = emulator::CaseOutcome::kSilentlyWrong;
  one.fault_at = std::chrono::milliseconds(1500);
  one.violated = "it stays \"there\", and still";
  one.margin = -1.0 / 3;
  one.note = "exit status 3\nlost";
  one.said = "lost at 12:34:56";
  one.wall_s = 7;
  EXPECT_EQ(
      emulator::canonical_line(one),
      "4711,jam,0.1,1e+21,,gen2,silently wrong,0,1500000000,,,,,"
      "\"it stays \"\"there\"\", and still\",-0.3333333333333333,,,exit status 3?lost,0,1,0\n");
}

TEST(Canonical, ComesInBlocksThatTogetherAreAll) {
  const TempDirectory directory;
  const auto path = directory.path() / "a.db";
  const auto cases = synthetic_cases(0, 5000);
  emulator::CampaignStore::create(path, synthetic_head(5000)).put(cases);
  std::size_t blocks = 0;
  std::size_t longest = 0;
  std::string all;
  emulator::export_canonical(emulator::CampaignStore::read(path), [&](std::string_view part) {
    ++blocks;
    longest = std::max(longest, part.size());
    all += part;
  });
  EXPECT_EQ(all, canonical(synthetic_head(5000), cases));
  EXPECT_GT(blocks, 3u);
  EXPECT_LT(longest, 100'000u);
}

}  // namespace
}  // namespace lk::test
