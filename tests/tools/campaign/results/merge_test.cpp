#include "tools/campaign/results/merge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/tools/campaign/results/campaign_files.hpp"

namespace lk::test {
namespace {

using emulator::CampaignHead;
using emulator::CampaignStore;
using emulator::CaseResult;
using emulator::merge_campaigns;
using emulator::Shard;

using Path = std::filesystem::path;

constexpr std::uint64_t kFew = 500;

struct Merge : ::testing::Test {
  TempDirectory directory;
  CampaignHead head = synthetic_head(kFew);
  std::mt19937 draw{3};

  Path at(const std::string& name) const { return directory.path() / name; }

  /// Those cases in any order and any batches.
  Path part(const std::string& name, std::vector<CaseResult> cases) {
    std::ranges::shuffle(cases, draw);
    auto store = CampaignStore::create(at(name), head);
    for (std::size_t from = 0; from < cases.size();) {
      const std::size_t size = std::min<std::size_t>(1 + draw() % 90, cases.size() - from);
      store.put({cases.data() + from, size});
      from += size;
    }
    return at(name);
  }
  Path shard(const Shard& which) {
    std::vector<CaseResult> cases;
    for (std::uint64_t n = which.index; n < kFew; n += which.of) {
      cases.push_back(synthetic_case(n));
    }
    const Path path = part(std::to_string(which.of) + "." + std::to_string(which.index), cases);
    CampaignStore::resume(path, head).note_shard(which);
    return path;
  }
  std::string refusal(const std::vector<Path>& parts) const {
    const std::string why = refused([&] { merge_campaigns(at("all.db"), parts); });
    EXPECT_FALSE(std::filesystem::exists(at("all.db")));
    return why;
  }
};

TEST_F(Merge, GivesTheBytesOfOneRunWhateverTheShards) {
  const std::string one = exported(part("one.db", synthetic_cases(0, kFew)));
  EXPECT_EQ(one, canonical(head, synthetic_cases(0, kFew)));
  for (const std::uint64_t of : {1u, 2u, 3u, 7u, 40u}) {
    std::vector<Path> parts;
    for (std::uint64_t i = 0; i < of; ++i) parts.push_back(shard({i, of}));
    std::ranges::shuffle(parts, draw);
    const Path all = at("all" + std::to_string(of));
    const auto summary = merge_campaigns(all, parts);
    EXPECT_EQ(summary.text(), "500 of 500 cases");
    EXPECT_TRUE(summary.is_whole);
    EXPECT_EQ(exported(all), one) << of;
    EXPECT_EQ(CampaignStore::read(all).shards().size(), of);
    EXPECT_EQ(CampaignStore::read(all).head(), head);
  }
}

TEST_F(Merge, OfMergesIsTheSame) {
  merge_campaigns(at("a.db"), std::vector{shard({0, 3}), shard({2, 3})});
  merge_campaigns(at("b.db"), std::vector{at("a.db"), shard({1, 3})});
  EXPECT_EQ(exported(at("b.db")), canonical(head, synthetic_cases(0, kFew)));
  EXPECT_EQ(CampaignStore::resume(at("b.db"), head).count(), kFew) << "and can be gone on with";
}

TEST_F(Merge, SaysWhatIsMissing) {
  const auto summary = merge_campaigns(at("all.db"), std::vector{shard({0, 4}), shard({2, 4})});
  EXPECT_EQ(summary.cases, 250u);
  EXPECT_EQ(summary.of, 500u);
  EXPECT_EQ(summary.missing, (std::vector<Shard>{{1, 4}, {3, 4}}));
  EXPECT_EQ(summary.text(), "250 of 500 cases; missing: shard 1/4, 3/4");
  EXPECT_FALSE(summary.is_whole);
}

TEST_F(Merge, NamesTenThatAreMissing) {
  EXPECT_EQ(merge_campaigns(at("all.db"), std::vector{shard({0, 20})}).text(),
            "25 of 500 cases; missing: shard 1/20, 2/20, 3/20, 4/20, 5/20, 6/20, 7/20, 8/20, "
            "9/20, 10/20 and 9 more");
}

TEST_F(Merge, TakesACaseThatTwoPartsHaveOnce) {
  auto again = synthetic_cases(90, 200);
  for (auto& one : again) one.wall_s += 1;  // another machine
  const auto summary = merge_campaigns(
      at("all.db"), std::vector{part("a", synthetic_cases(0, 100)), part("b", again)});
  EXPECT_EQ(summary.cases, 200u);
  EXPECT_EQ(exported(at("all.db")), canonical(head, synthetic_cases(0, 200)));
}

TEST_F(Merge, RefusesOneCaseWithTwoResults) {
  auto again = synthetic_cases(90, 200);
  again[5].runs = 3;
  const std::string why = refusal({part("a", synthetic_cases(0, 100)), part("b", again)});
  EXPECT_NE(why.find("b: has another result of case 95 than "), std::string::npos) << why;
}

TEST_F(Merge, RefusesAnotherPlanVersionOrInput) {
  const Path first = part("a", synthetic_cases(0, 10));
  const auto other = [&](const std::string& name, auto change) {
    head = synthetic_head(kFew);
    change(head);
    return refusal({first, part(name, synthetic_cases(10, 20))});
  };
  EXPECT_NE(other("v", [](auto& h) { h.version = "0.3.0"; }).find("v: of version 0.3.0"),
            std::string::npos);
  EXPECT_NE(other("p", [](auto& h) { h.plan_name = "x"; }).find("p: of the plan x"),
            std::string::npos);
  EXPECT_NE(other("t", [](auto& h) { h.plan_text += "#"; }).find("t: of another plan"),
            std::string::npos);
  EXPECT_NE(other("i", [](auto& h) { h.input_hash = "0"; }).find("i: of other input"),
            std::string::npos);
}

TEST_F(Merge, OverwritesNothing) {
  std::ofstream(at("precious")) << "precious";
  const std::vector parts = {part("a", synthetic_cases(0, 10))};
  EXPECT_NE(refused([&] { merge_campaigns(at("precious"), parts); }), "");
  EXPECT_EQ(bytes_of(at("precious")), "precious");
  EXPECT_NE(refused([&] { merge_campaigns(at("a"), parts); }), "") << "nor what it reads";
}

TEST_F(Merge, OfNothingIsRefused) { EXPECT_NE(refusal({}), ""); }

TEST_F(Merge, LeavesNothingUnfinished) {
  refusal({part("a", synthetic_cases(0, 10)), at("not there")});
  EXPECT_EQ(directory.names(), std::set<std::string>{"a"});
}

}  // namespace
}  // namespace lk::test
