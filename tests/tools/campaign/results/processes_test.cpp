// What other processes do to the file, and what is left of one that is killed.

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <random>

#include "tests/tools/campaign/results/campaign_files.hpp"
#include "tools/campaign/results/merge.hpp"
#include "tools/campaign/results/new_file.hpp"
#include "tools/campaign/results/sqlite.hpp"

namespace lk::test {
namespace {

using emulator::CampaignStore;

/// A process that runs `act` with the end of a pipe to write to; ends with this, if not before.
class Child {
 public:
  template <class Act>
  explicit Child(Act act) {
    int ends[2];
    if (::pipe(ends) != 0) throw std::runtime_error("pipe");
    process_ = ::fork();
    if (process_ == 0) {
      ::close(ends[0]);
      act(ends[1]);
      ::_exit(0);
    }
    ::close(ends[1]);
    from_ = ends[0];
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    kill();
    ::close(from_);
  }

  /// False: it writes no more.
  bool read(std::uint64_t& value) const {
    return ::read(from_, &value, sizeof value) == sizeof value;
  }
  void kill() { end(SIGKILL); }
  void end(int signal) {
    if (process_ <= 0) return;
    ::kill(process_, signal);
    ::waitpid(process_, nullptr, 0);
    process_ = 0;
  }

 private:
  pid_t process_ = 0;
  int from_ = -1;
};

void tell(int to, std::uint64_t value) {
  if (::write(to, &value, sizeof value) != sizeof value) ::_exit(1);
}

constexpr std::uint64_t kMany = 1'000'000;

/// Puts what is not there yet, in batches, tells how many cases it has put, and does not end.
[[noreturn]] void put_for_ever(const std::filesystem::path& path, std::uint64_t batch, int to) {
  auto store = CampaignStore::resume(path, synthetic_head(kMany));
  for (std::uint64_t at = store.count();; at += batch) {
    store.put(synthetic_cases(at, at + batch));
    tell(to, at + batch);
  }
}

std::string integrity(const std::filesystem::path& path) {
  const emulator::Database database(path);
  emulator::Statement row(database, "PRAGMA integrity_check");
  return row.step() ? row.text() : "";
}

TEST(Killed, LosesNoCaseThatWasPut) {
  const TempDirectory directory;
  const auto path = directory.path() / "a.db";
  CampaignStore::create(path, synthetic_head(kMany));
  std::mt19937 draw(24);
  std::uint64_t told = 0;
  for (int round = 0; round < 40; ++round) {
    const std::uint64_t batch = 1 + draw() % 300;
    Child child([&](int to) { put_for_ever(path, batch, to); });
    // From wherever it is when that is heard of: in the midst of a later batch.
    for (auto reports = draw() % 5; reports > 0; --reports) ASSERT_TRUE(child.read(told));
    child.kill();
    while (child.read(told)) {
    }
    ASSERT_EQ(integrity(path), "ok");
    const auto store = CampaignStore::read(path);
    ASSERT_GE(store.count(), told);
    ASSERT_LE(store.count(), told + batch);
    told = store.count();
  }
  EXPECT_GT(told, 0u);
  EXPECT_EQ(exported(path), canonical(synthetic_head(kMany), synthetic_cases(0, told)));
}

TEST(Killed, BeforeItsFirstCaseLeavesACampaignOrNothing) {
  const TempDirectory directory;
  const auto path = directory.path() / "a.db";
  for (int round = 0; round < 40; ++round) {
    Child child([&](int to) {
      tell(to, 0);
      CampaignStore::create(path, synthetic_head(kMany));
    });
    std::uint64_t begun = 0;
    ASSERT_TRUE(child.read(begun));
    child.kill();
    if (!std::filesystem::exists(path)) continue;
    EXPECT_EQ(CampaignStore::read(path).head(), synthetic_head(kMany));
    std::filesystem::remove(path);
  }
}

TEST(Interrupted, LeavesNothingUnfinished) {
  const TempDirectory directory;
  const auto path = directory.path() / "a.db";
  Child child([&](int to) {
    const emulator::NewFile file(path);
    tell(to, 0);
    ::pause();
  });
  std::uint64_t begun = 0;
  ASSERT_TRUE(child.read(begun));
  EXPECT_EQ(directory.names().size(), 1u);
  child.end(SIGTERM);
  EXPECT_TRUE(directory.names().empty());
}

/// A file that may grow no more stands for a disk that is full.
TEST(FullDisk, KeepsWhatWasPutAndSaysSo) {
  const TempDirectory directory;
  const auto path = directory.path() / "a.db";
  CampaignStore::create(path, synthetic_head(kMany));
  Child child([&](int to) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{200'000, 200'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    std::uint64_t at = 0;
    const std::string why = refused([&] {
      auto store = CampaignStore::resume(path, synthetic_head(kMany));
      for (;; at += 50) store.put(synthetic_cases(at, at + 50));
    });
    tell(to, why.find("a.db: cannot be written: a quota") != std::string::npos);
    tell(to, at);
  });
  std::uint64_t said = 0;
  std::uint64_t put = 0;
  ASSERT_TRUE(child.read(said));
  ASSERT_TRUE(child.read(put));
  EXPECT_EQ(said, 1u);
  EXPECT_GT(put, 1000u);
  EXPECT_EQ(exported(path), canonical(synthetic_head(kMany), synthetic_cases(0, put)));
}

/// While `child` has it open.
void expect_all_are_refused(const std::filesystem::path& path) {
  const auto head = synthetic_head(kMany);
  const std::string why = "a.db: another process has it open";
  EXPECT_NE(refused([&] { CampaignStore::resume(path, head); }).find(why), std::string::npos);
  EXPECT_NE(refused([&] { CampaignStore::read(path); }).find(why), std::string::npos);
  const auto out = path.parent_path() / "all.db";
  EXPECT_NE(refused([&] { emulator::merge_campaigns(out, std::vector{path}); }).find(why),
            std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(InUse, KeepsOthersOutBetweenItsBatchesToo) {
  const TempDirectory directory;
  const auto path = directory.path() / "a.db";
  CampaignStore::create(path, synthetic_head(kMany));
  Child child([&](int to) {
    auto store = CampaignStore::resume(path, synthetic_head(kMany));
    tell(to, 0);
    ::pause();
  });
  std::uint64_t there = 0;
  ASSERT_TRUE(child.read(there));
  expect_all_are_refused(path);
  child.kill();
  EXPECT_EQ(CampaignStore::resume(path, synthetic_head(kMany)).count(), 0u);
}

TEST(InUse, OfARunThatPutsCasesNothingHalfIsRead) {
  const TempDirectory directory;
  const auto path = directory.path() / "a.db";
  CampaignStore::create(path, synthetic_head(kMany));
  Child child([&](int to) { put_for_ever(path, 50, to); });
  std::uint64_t there = 0;
  for (int round = 0; round < 10; ++round) {
    ASSERT_TRUE(child.read(there));
    expect_all_are_refused(path);
  }
}

TEST(InUse, ReadersKeepWritersOutAndNotEachOther) {
  const TempDirectory directory;
  const auto path = directory.path() / "a.db";
  CampaignStore::create(path, synthetic_head(kMany)).put(synthetic_cases(0, 5));
  Child child([&](int to) {
    const auto store = CampaignStore::read(path);
    tell(to, store.count());
    ::pause();
  });
  std::uint64_t there = 0;
  ASSERT_TRUE(child.read(there));
  EXPECT_EQ(there, 5u);
  EXPECT_EQ(CampaignStore::read(path).count(), 5u);
  EXPECT_NE(refused([&] { CampaignStore::resume(path, synthetic_head(kMany)); }), "");
}

}  // namespace
}  // namespace lk::test
