// Files that are no campaign, or no longer: one line, whatever is in them.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <ostream>
#include <random>

#include "tests/tools/campaign/results/campaign_files.hpp"
#include "tools/campaign/results/merge.hpp"
#include "tools/campaign/results/sqlite.hpp"

namespace lk::test {
namespace {

using emulator::CampaignStore;

/// Everything that is done with a file. Returns whether it was refused.
bool walk(const std::filesystem::path& path) {
  const std::string why = refused([&] {
    const auto store = CampaignStore::read(path);
    store.count();
    store.find(7);
    store.shards();
    exported(path);
  });
  EXPECT_TRUE(why.empty() || why.starts_with(path.string() + ": ")) << why;
  refused([&] { CampaignStore::resume(path, synthetic_head(1000)); });
  return !why.empty();
}

void merge_alone(const std::filesystem::path& path) {
  const auto out = path.parent_path() / "out.db";
  refused([&] { emulator::merge_campaigns(out, std::vector{path}); });
  std::filesystem::remove(out);
}

struct Damaged : ::testing::Test {
  TempDirectory directory;
  std::filesystem::path path = directory.path() / "a.db";
  std::string whole;

  Damaged() {
    {
      auto store = CampaignStore::create(path, synthetic_head(1000));
      store.note_shard({0, 2});
      store.put(synthetic_cases(0, 400));
    }
    whole = bytes_of(path);
  }
  bool is_refused(const std::string& bytes) const {
    std::filesystem::remove(path);  // a file that is cut off and written again goes to the disk
    std::ofstream(path, std::ios::binary) << bytes;
    return walk(path);
  }
};

TEST_F(Damaged, WholeIsNot) { EXPECT_FALSE(is_refused(whole)); }

TEST_F(Damaged, WhereverItWasCutOff) {
  std::mt19937 draw(1);
  for (std::size_t size = 0; size < whole.size(); size += 1 + draw() % 1500) {
    EXPECT_TRUE(is_refused(whole.substr(0, size))) << size;
  }
}

TEST_F(Damaged, WhicheverBitsAreTurned) {
  std::mt19937 draw(2);
  int refusals = 0;
  for (int round = 0; round < 1000; ++round) {
    std::string bytes = whole;
    for (auto flips = 1 + draw() % 4; flips > 0; --flips) {
      bytes[draw() % bytes.size()] ^= static_cast<char>(1 << draw() % 8);
    }
    // The first page has the most that can be wrong.
    if (round % 3 == 0) bytes[draw() % 4096] ^= static_cast<char>(1 << draw() % 8);
    refusals += is_refused(bytes) ? 1 : 0;
    if (round % 20 == 0) merge_alone(path);
  }
  EXPECT_GT(refusals, 0);
}

TEST_F(Damaged, WhateverPageIsInAnothersPlace) {
  constexpr std::size_t kPage = 4096;
  const std::size_t pages = whole.size() / kPage;
  ASSERT_GT(pages, 1U);
  for (std::size_t i = 0; i < pages; ++i) {
    for (std::size_t j = 0; j < pages; ++j) {
      if (i == j) continue;
      std::string bytes = whole;
      bytes.replace(i * kPage, kPage, whole, j * kPage, kPage);
      is_refused(bytes);
    }
  }
}

TEST_F(Damaged, Foreign) {
  EXPECT_TRUE(is_refused("precious"));
  EXPECT_TRUE(is_refused(std::string(100'000, 'x')));
  std::filesystem::remove(path);
  EXPECT_TRUE(walk(path)) << "not there";
  std::filesystem::create_directory(path);
  EXPECT_TRUE(walk(path)) << "a directory";
  std::filesystem::remove(path);
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  EXPECT_TRUE(walk(path)) << "a pipe, at which nobody is";
}

/// What `sql` makes of a good file is refused with `why`.
struct Change {
  const char* sql;
  const char* why;
};
/// The names of tests have it.
void PrintTo(const Change& change, std::ostream* out) { *out << change.sql; }
class Changed : public Damaged, public ::testing::WithParamInterface<Change> {};

TEST_P(Changed, IsToldSo) {
  emulator::Database(path).run(GetParam().sql);
  const std::string why = refused([&] { exported(path); });
  EXPECT_NE(why.find(GetParam().why), std::string::npos) << why;
}

INSTANTIATE_TEST_SUITE_P(
    Each, Changed,
    ::testing::Values(Change{"PRAGMA application_id = 0", "not the results of a campaign"},
                      Change{"PRAGMA user_version = 1",
                             "its format is 1, and this program reads 2"},
                      Change{"DROP VIEW cases", "damaged"},
                      Change{"ALTER TABLE results ADD COLUMN more REAL", "damaged"},
                      Change{"DELETE FROM campaign", "damaged"},
                      Change{"UPDATE campaign SET sampling = 1", "damaged"},
                      Change{"UPDATE dimensions SET position = 9 WHERE position = 0", "damaged"},
                      Change{"UPDATE results SET outcome = 9", "damaged"},
                      Change{"UPDATE results SET v0 = 900", "damaged"},
                      Change{"UPDATE results SET fault_at_ns = -1", "damaged"},
                      Change{"UPDATE results SET number = 1000 WHERE number = 0", "damaged"},
                      Change{"DELETE FROM words WHERE id = 10", "damaged"}));

}  // namespace
}  // namespace lk::test
