// What is synced, and what happens when that fails: this program's fsync is its own.

#include "emulator/rom/durable_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <mutex>
#include <semaphore>
#include <vector>

#include "emulator/program/cli.hpp"
#include "emulator/rom/rom_store.hpp"
#include "emulator/rom/rom_writer.hpp"
#include "emulator/scenario/scenario_runner.hpp"
#include "tests/emulator/rom_support.hpp"
#include "tests/support/frames.hpp"
#include "tests/support/test_bus.hpp"

namespace {

std::mutex mutex;           // of the two below
std::vector<ino_t> synced;  // inodes, in order
ino_t refused = 0;          // fsync of this one fails

ino_t inode(const std::filesystem::path& path) {
  struct stat status {};
  EXPECT_EQ(::stat(path.c_str(), &status), 0) << path;
  return status.st_ino;
}

std::ptrdiff_t times_synced(const std::filesystem::path& path) {
  const ino_t wanted = inode(path);
  const std::lock_guard lock(mutex);
  return std::ranges::count(synced, wanted);
}

}  // namespace

extern "C" int fsync(int fd) {
  struct stat status {};
  ::fstat(fd, &status);
  const std::lock_guard lock(mutex);
  synced.push_back(status.st_ino);
  if (status.st_ino == refused) {
    errno = EIO;
    return -1;
  }
  return static_cast<int>(::syscall(SYS_fsync, fd));
}

namespace lk::emulator {
namespace {

class Synced : public testing::Test {
 protected:
  Synced() {
    const std::lock_guard lock(mutex);
    synced.clear();
    refused = 0;
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

  TempDirectory directory_;
};

/// Writes one after the other; gives what became of the last.
int write(const std::filesystem::path& path, int times) {
  const Descriptor directory(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  const RomPlace place{directory.get(), "test-1.toml", 0, {"test", 1, "test"}};
  std::binary_semaphore done(0);
  int last = -1;
  RomWriter writer([&](const RomPlace&, const RomWrite&, int error) {
    last = error;
    done.release();
  });
  for (int n = 1; n <= times; ++n) {
    writer.write(place, rom_write(1, static_cast<std::uint64_t>(n)));
    done.acquire();
  }
  return last;
}

TEST_F(Synced, TheEntryOfADirectoryThatWasThereWithTheFirstFile) {
  const auto path = make("rom");
  EXPECT_EQ(write(path, 3), 0);
  EXPECT_EQ(times_synced(directory_.path()), 1);
  EXPECT_EQ(times_synced(path), 3);
}

TEST_F(Synced, NothingIsDurableInADirectoryThatIsNot) {
  const auto path = make("rom");
  refuse(directory_.path());
  EXPECT_EQ(write(path, 2), EIO);
  EXPECT_EQ(times_synced(directory_.path()), 2) << "it is tried again";
}

TEST_F(Synced, TheEntryOfADirectoryThatARunKeepsRomIn) {
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

TEST_F(Synced, AWipeThatMayComeBackIsNone) {
  const auto path = make("rom");
  refuse(path);
  std::vector<BusConfig> buses = {test::bus_config({1})};
  const RomOptions options{.directory = path, .wipe = true};
  EXPECT_THROW(RomStore(options, buses), StartError);
}

}  // namespace
}  // namespace lk::emulator
