#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "tests/tools/campaign/results/campaign_files.hpp"
#include "tools/campaign/results/campaign_store.hpp"
#include "tools/campaign/results/sqlite.hpp"

namespace lk::test {
namespace {

using emulator::CampaignHead;
using emulator::CampaignStore;
using emulator::CaseResult;
using emulator::Shard;

struct Store : ::testing::Test {
  TempDirectory directory;
  std::filesystem::path path = directory.path() / "a.db";
  CampaignHead head = synthetic_head(1000);

  void fill(std::uint64_t from, std::uint64_t to) const {
    CampaignStore::create(path, head).put(synthetic_cases(from, to));
  }
  std::string resumed_with(const CampaignHead& other) const {
    return refused([&] { CampaignStore::resume(path, other); });
  }
};

CaseResult full_case() {
  CaseResult one;
  one.number = 999;
  one.generation = 7;
  one.values = {"jam", 0.1, std::nullopt, 1e-300, "gen1"};
  one.outcome = emulator::CaseOutcome::kCrash;
  one.fault_at = emulator::SimTime(0);
  one.first_effect_at = emulator::SimTime(1);
  one.detected_by_drive = emulator::SimTime(4'999'999'999);
  one.detected_by_host = emulator::SimTime(std::numeric_limits<std::int64_t>::max());
  one.violated_at = emulator::SimTime(2);
  one.violated = "it, or \"so\"";
  one.margin = -0.25;
  one.state = "running";
  one.command = "A4";
  one.note = "a\nb";
  one.real_time = true;
  one.runs = std::numeric_limits<std::uint32_t>::max();
  one.flips = 2;
  one.said = "at 0.1 s: \"lost\"";
  one.wall_s = 0.125;
  return one;
}

TEST_F(Store, GivesBackWhatWasPut) {
  const CaseResult put = full_case();
  CampaignStore::create(path, head).put({&put, 1});
  const auto got = CampaignStore::read(path).find(999);
  ASSERT_TRUE(got);
  EXPECT_EQ(got->number, put.number);
  EXPECT_EQ(got->generation, put.generation);
  EXPECT_EQ(got->values, put.values);
  EXPECT_EQ(got->outcome, put.outcome);
  EXPECT_EQ(got->fault_at, put.fault_at);
  EXPECT_EQ(got->first_effect_at, put.first_effect_at);
  EXPECT_EQ(got->detected_by_drive, put.detected_by_drive);
  EXPECT_EQ(got->detected_by_host, put.detected_by_host);
  EXPECT_EQ(got->violated_at, put.violated_at);
  EXPECT_EQ(got->violated, put.violated);
  EXPECT_EQ(got->margin, put.margin);
  EXPECT_EQ(got->state, put.state);
  EXPECT_EQ(got->command, put.command);
  EXPECT_EQ(got->note, put.note);
  EXPECT_EQ(got->real_time, put.real_time);
  EXPECT_EQ(got->runs, put.runs);
  EXPECT_EQ(got->flips, put.flips);
  EXPECT_EQ(got->said, put.said);
  EXPECT_EQ(got->wall_s, put.wall_s);
}

TEST_F(Store, GivesBackItsHead) {
  fill(0, 0);
  EXPECT_EQ(CampaignStore::read(path).head(), head);
  head.tolerant_time.reset();
  head.dimensions.clear();
  const auto other = directory.path() / "b.db";
  CampaignStore::create(other, head);
  EXPECT_EQ(CampaignStore::read(other).head(), head);
}

TEST_F(Store, KnowsWhatIsFinished) {
  auto store = CampaignStore::create(path, head);
  EXPECT_EQ(store.count(), 0u);
  store.put(synthetic_cases(10, 20));
  EXPECT_EQ(store.count(), 10u);
  EXPECT_TRUE(store.has(10));
  EXPECT_FALSE(store.has(20));
  EXPECT_FALSE(store.has(std::numeric_limits<std::uint64_t>::max()));
  EXPECT_FALSE(store.find(9));
  store.put({});
  EXPECT_EQ(store.count(), 10u);
}

TEST_F(Store, GoesOnWhereItWas) {
  fill(0, 10);
  {
    auto store = CampaignStore::resume(path, head);
    EXPECT_TRUE(store.has(9));
    store.put(synthetic_cases(10, 30));
  }
  EXPECT_EQ(exported(path), canonical(head, synthetic_cases(0, 30)));
}

TEST_F(Store, LeavesNothingBesideItsFile) {
  fill(0, 10);
  EXPECT_EQ(directory.names(), std::set<std::string>{"a.db"});
}

TEST_F(Store, IsNotMadeWhereSomethingIs) {
  std::ofstream(path) << "precious";
  EXPECT_NE(refused([&] { CampaignStore::create(path, head); }).find("a.db: there is such a file"),
            std::string::npos);
  EXPECT_EQ(bytes_of(path), "precious");
  const auto link = directory.path() / "link.db";
  std::filesystem::create_symlink("nowhere", link);
  EXPECT_NE(refused([&] { CampaignStore::create(link, head); }), "");
  EXPECT_NE(refused([&] { CampaignStore::create(directory.path() / "no" / "a.db", head); }), "");
}

TEST_F(Store, GoesOnWithItsOwnCampaignOnly) {
  fill(0, 10);
  const std::string before = bytes_of(path);
  CampaignHead other = head;
  other.version = "0.3.0";
  EXPECT_NE(resumed_with(other).find("of version 0.2.0, and not of 0.3.0"), std::string::npos);
  other = head;
  other.plan_name = "one_fault";
  EXPECT_NE(resumed_with(other).find("of the plan every_fault"), std::string::npos);
  other = head;
  other.plan_text += "seed = 2\n";
  EXPECT_NE(resumed_with(other).find("of another plan"), std::string::npos);
  other = head;
  other.input_hash = "0000";
  EXPECT_NE(resumed_with(other).find("of other input"), std::string::npos);
  other = head;
  other.dimensions[1].to = 4;
  EXPECT_NE(resumed_with(other).find("of another campaign"), std::string::npos);
  EXPECT_EQ(bytes_of(path), before);
}

TEST_F(Store, TakesTheSameCaseAgainAndNoOther) {
  auto store = CampaignStore::create(path, head);
  auto cases = synthetic_cases(0, 10);
  store.put(cases);
  cases[3].wall_s += 1;
  store.put(cases);
  cases[3].flips = 9;
  cases.push_back(synthetic_case(10));
  EXPECT_NE(refused([&] { store.put(cases); }).find("another result of case 3"), std::string::npos);
  EXPECT_EQ(store.count(), 10u) << "all of a batch or nothing";
}

TEST_F(Store, RefusesWhatIsNoneOfItsCases) {
  auto store = CampaignStore::create(path, head);
  const auto put = [&](auto change) {
    std::vector cases = {synthetic_case(1), full_case()};
    change(cases[1]);
    EXPECT_THROW(store.put(cases), std::invalid_argument);
  };
  put([](CaseResult& one) { one.number = 1000; });
  put([](CaseResult& one) { one.values.pop_back(); });
  put([](CaseResult& one) { one.values[0] = 1.0; });
  put([](CaseResult& one) { one.values[1] = "jam"; });
  put([](CaseResult& one) { one.values[1] = std::numeric_limits<double>::quiet_NaN(); });
  put([](CaseResult& one) { one.margin = std::numeric_limits<double>::quiet_NaN(); });
  put([](CaseResult& one) { one.fault_at = emulator::SimTime(-1); });
  EXPECT_EQ(store.count(), 0u);
}

TEST_F(Store, ForgetsWordsOfABatchThatFailed) {
  auto store = CampaignStore::create(path, head);
  std::vector cases = {synthetic_case(1), synthetic_case(2)};
  cases[0].state = "never seen before";
  cases[1].number = 5000;
  EXPECT_THROW(store.put(cases), std::invalid_argument);
  cases[1].number = 2;
  cases[1].state = "nor this";
  std::swap(cases[0], cases[1]);
  store.put(cases);
  EXPECT_EQ(store.find(1)->state, "never seen before");
  EXPECT_EQ(store.find(2)->state, "nor this");
}

TEST_F(Store, SaysTwoDimensionsWithOneName) {
  head.dimensions[1].name = "FAULT.for_s";
  EXPECT_NE(refused([&] { CampaignStore::create(path, head); }).find("fault.for_s"),
            std::string::npos);
  head.dimensions[1].name = "Outcome";
  EXPECT_NE(refused([&] { CampaignStore::create(path, head); }), "");
  EXPECT_TRUE(std::filesystem::is_empty(directory.path()));
}

TEST_F(Store, KnowsItsShards) {
  auto store = CampaignStore::create(path, head);
  EXPECT_TRUE(store.shards().empty());
  store.note_shard({3, 10});
  store.note_shard({2, 10});
  store.note_shard({3, 10});
  EXPECT_EQ(store.shards(), (std::vector<Shard>{{2, 10}, {3, 10}}));
  EXPECT_THROW(store.note_shard({10, 10}), std::invalid_argument);
}

TEST_F(Store, AnswersPeopleInTheirWords) {
  const CaseResult one = full_case();
  CampaignStore::create(path, head).put({&one, 1});
  const emulator::Database database(path);
  emulator::Statement row(database,
                          "SELECT outcome, \"fault.kind\", \"fault.at_s\", state, violated, "
                          "detected_by_drive_ns, wall_s, count(*) FROM cases GROUP BY outcome");
  ASSERT_TRUE(row.step());
  EXPECT_EQ(row.text(), "crash");
  EXPECT_EQ(row.text(), "jam");
  EXPECT_EQ(row.real(), 0.1);
  EXPECT_EQ(row.text(), "running");
  EXPECT_EQ(row.text(), one.violated);
  EXPECT_EQ(row.integer(), 4'999'999'999);
  EXPECT_EQ(row.real(), 0.125);
  EXPECT_EQ(row.integer(), 1);
}

}  // namespace
}  // namespace lk::test
