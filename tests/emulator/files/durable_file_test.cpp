// Synced files, and failed syncs: this program replaces fsync.

#include "emulator/files/durable_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <semaphore>
#include <sstream>
#include <string>
#include <vector>

#include "emulator/core/start_error.hpp"
#include "emulator/files/rom_store.hpp"
#include "emulator/monitor/scenario/scenario_runner.hpp"
#include "tests/emulator/rom/rom_support.hpp"
#include "tests/support/frames.hpp"
#include "tests/support/temp_directory.hpp"
#include "tests/support/test_bus.hpp"

namespace {

/// A sync, and the files that a power cut just before it could have left.
struct Sync {
  ino_t inode = 0;
  std::string file;        // contents by name; empty: does not exist
  std::string unfinished;  // contents of its temporary file

  friend bool operator==(const Sync&, const Sync&) = default;
  friend void PrintTo(const Sync& sync, std::ostream* out) {
    *out << sync.inode << " \"" << sync.file << "\" \"" << sync.unfinished << '"';
  }
};

std::mutex mutex;               // protects the variables below
std::vector<Sync> synced;       // in order
ino_t refused = 0;              // fsync of this inode fails
bool files_refused = false;     // fsync of every regular file fails
std::filesystem::path watched;  // the watched file

std::string text_of(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

ino_t inode(const std::filesystem::path& path) {
  struct stat status {};
  EXPECT_EQ(::stat(path.c_str(), &status), 0) << path;
  return status.st_ino;
}

std::ptrdiff_t times_synced(const std::filesystem::path& path) {
  const ino_t wanted = inode(path);
  const std::lock_guard lock(mutex);
  return std::ranges::count(synced, wanted, &Sync::inode);
}

}  // namespace

extern "C" int fsync(int fd) {
  struct stat status {};
  ::fstat(fd, &status);
  const std::lock_guard lock(mutex);
  synced.push_back(
      {status.st_ino, text_of(watched), text_of(lk::emulator::unfinished(watched.string()))});
  if (status.st_ino == refused || (files_refused && S_ISREG(status.st_mode))) {
    errno = EIO;
    return -1;
  }
  return static_cast<int>(::syscall(SYS_fsync, fd));
}

namespace lk::emulator {
namespace {

class DurableFile : public testing::Test {
 protected:
  DurableFile() {
    const std::lock_guard lock(mutex);
    synced.clear();
    refused = 0;
    files_refused = false;
    watched.clear();
  }
  std::filesystem::path make(const std::string& name) const {
    std::filesystem::create_directory(directory_.path() / name);
    return directory_.path() / name;
  }
  static void refuse(const std::filesystem::path& path) {
    const ino_t number = inode(path);
    const std::lock_guard lock(mutex);
    refused = number;
  }

  static void refuse_files() {
    const std::lock_guard lock(mutex);
    files_refused = true;
  }

  /// Records this file's contents at each sync from now on.
  static void watch(const std::filesystem::path& path) {
    const std::lock_guard lock(mutex);
    synced.clear();
    watched = path;
  }
  static std::vector<Sync> syncs() {
    const std::lock_guard lock(mutex);
    return synced;
  }

  test::TempDirectory directory_;
};

/// Writes `times` times; returns the result of the last write.
int write(const std::filesystem::path& path, int times) {
  const Descriptor directory(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  const RomFile place{directory.get(), "test-1.toml", 0, {"test", 1, "test"}};
  std::binary_semaphore done(0);
  int last = -1;
  RomWriter writer([&](const RomFile&, const RomWrite&, int error) {
    last = error;
    done.release();
  });
  for (int n = 1; n <= times; ++n) {
    writer.write(place, rom_write(1, static_cast<std::uint64_t>(n)));
    done.acquire();
  }
  return last;
}

TEST_F(DurableFile, FileBeforeRenameAndDirectoryAfterwards) {
  const auto path = make("rom");
  const Descriptor directory(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  ASSERT_EQ(write_durably(directory.get(), "a", "before"), 0);
  watch(path / "a");
  ASSERT_EQ(write_durably(directory.get(), "a", "after"), 0);
  const ino_t file = inode(path / "a");  // one inode under both names
  EXPECT_EQ(syncs(),
            (std::vector<Sync>{{file, "before", "after"}, {inode(path), "after", "before"}}));
  EXPECT_FALSE(std::filesystem::exists(path / unfinished("a")));
}

TEST_F(DurableFile, FailureOfTheFilePreventsTheRename) {
  const auto path = make("rom");
  const Descriptor directory(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  ASSERT_EQ(write_durably(directory.get(), "a", "before"), 0);
  refuse_files();
  EXPECT_EQ(write_durably(directory.get(), "a", "after"), EIO);
  EXPECT_EQ(text_of(path / "a"), "before");
  EXPECT_FALSE(std::filesystem::exists(path / unfinished("a")));
}

/// The writer gets an error, so the last acknowledged contents must hold, now and at the next
/// start.
TEST_F(DurableFile, FailureOfTheDirectoryRestoresTheOldFile) {
  const auto path = make("rom");
  const Descriptor directory(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  ASSERT_EQ(write_durably(directory.get(), "a", "11"), 0);
  refuse(path);
  EXPECT_EQ(write_durably(directory.get(), "a", "30"), EIO);
  EXPECT_EQ(text_of(path / "a"), "11");
  EXPECT_EQ(write_durably(directory.get(), "b", "30"), EIO);
  EXPECT_FALSE(std::filesystem::exists(path / "b"));
  EXPECT_FALSE(std::filesystem::exists(path / unfinished("a")));
}

TEST_F(DurableFile, ParentsOfAllNewDirectories) {
  const auto a = directory_.path() / "a";
  std::vector<BusConfig> buses = {test::bus_config({1})};
  const RomOptions options{.directory = a / "b" / "c", .wipe = false};
  const RomStore store(options, buses);
  for (const auto& holder : {directory_.path(), a, a / "b"}) {
    EXPECT_GE(times_synced(holder), 1) << holder;
  }
}

TEST_F(DurableFile, FailureOfTheParentRejectsTheStore) {
  refuse(directory_.path());
  std::vector<BusConfig> buses = {test::bus_config({1})};
  const RomOptions options{.directory = directory_.path() / "a" / "b", .wipe = false};
  EXPECT_THROW(RomStore(options, buses), StartError);
}

TEST_F(DurableFile, ParentOfAnExistingDirectoryOnce) {
  const auto path = make("rom");
  EXPECT_EQ(write(path, 3), 0);
  EXPECT_EQ(times_synced(directory_.path()), 1);
  EXPECT_EQ(times_synced(path), 3);
}

TEST_F(DurableFile, FailureOfTheParentFailsEachWrite) {
  const auto path = make("rom");
  refuse(directory_.path());
  EXPECT_EQ(write(path, 2), EIO);
  EXPECT_EQ(times_synced(directory_.path()), 2) << "it is tried again";
}

TEST_F(DurableFile, ParentOfTheRomDirectoryOfARun) {
  const auto path = make("rom");
  Scenario scenario;
  scenario.robot = {test::bus_config({1})};
  scenario.duration = std::chrono::milliseconds(200);
  scenario.sends = {{.frame = test::frame("141#3200010203040506"),
                     .every = std::chrono::milliseconds(100),
                     .times = 2}};
  RunOutputs outputs;
  outputs.rom = path;
  run_scenario(scenario, outputs);
  EXPECT_EQ(times_synced(path), 2);
  EXPECT_EQ(times_synced(directory_.path()), 1);
}

TEST_F(DurableFile, FailureOfTheDirectoryFailsTheWipe) {
  const auto path = make("rom");
  refuse(path);
  std::vector<BusConfig> buses = {test::bus_config({1})};
  const RomOptions options{.directory = path, .wipe = true};
  RomStore store(options, buses);
  EXPECT_THROW(store.wipe(), StartError);
}

}  // namespace
}  // namespace lk::emulator
