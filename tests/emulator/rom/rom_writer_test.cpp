#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <cerrno>
#include <csignal>
#include <semaphore>

#include "emulator/files/durable_file.hpp"
#include "emulator/files/rom_store.hpp"
#include "tests/emulator/rom/rom_support.hpp"
#include "tests/support/no_threads.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::emulator {
namespace rom_writer_test {

/// Limits the size of files, as a full disk does.
class SizeLimit {
 public:
  explicit SizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  SizeLimit(const SizeLimit&) = delete;
  SizeLimit& operator=(const SizeLimit&) = delete;
  ~SizeLimit() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

TEST(WriteDurably, ReplacesAllOrNothing) {
  const test::TempDirectory directory;
  const Descriptor fd(::open(directory.path().c_str(), O_RDONLY | O_DIRECTORY));
  ASSERT_EQ(write_durably(fd.get(), "a.toml", "first"), 0);
  ASSERT_EQ(write_durably(fd.get(), "a.toml", "2nd"), 0);
  EXPECT_EQ(directory.text_of("a.toml"), "2nd");
  {
    const SizeLimit full(10);
    EXPECT_EQ(write_durably(fd.get(), "a.toml", "longer than ten bytes"), EFBIG);
  }
  EXPECT_EQ(directory.text_of("a.toml"), "2nd");
  EXPECT_EQ(directory.names(), std::set<std::string>{"a.toml"}) << "half a file is no use";
}

TEST(WriteDurably, ReadersSeeCompleteFiles) {
  const test::TempDirectory directory;
  const Descriptor fd(::open(directory.path().c_str(), O_RDONLY | O_DIRECTORY));
  const std::string a(100'000, 'a');
  const std::string b(70'000, 'b');
  ASSERT_EQ(write_durably(fd.get(), "x", a), 0);
  std::thread writer([&] {
    for (int i = 0; i < 50; ++i) EXPECT_EQ(write_durably(fd.get(), "x", i % 2 == 0 ? b : a), 0);
  });
  for (int i = 0; i < 200; ++i) {
    const std::string seen = directory.text_of("x");
    EXPECT_TRUE(seen == a || seen == b) << seen.size();
  }
  writer.join();
}

/// An attacker with files next to it must neither choose the overwritten file nor block the writer.
TEST(WriteDurably, DoesNotWriteToForeignFiles) {
  const test::TempDirectory directory;
  const Descriptor fd(::open(directory.path().c_str(), O_RDONLY | O_DIRECTORY));
  const std::string fresh = directory.path(unfinished("a"));
  const std::string other = directory.put("other", "precious");
  std::filesystem::create_hard_link(other, fresh);
  EXPECT_EQ(write_durably(fd.get(), "a", "text"), 0);
  std::filesystem::create_symlink(other, fresh);
  EXPECT_EQ(write_durably(fd.get(), "a", "text"), 0);
  ASSERT_EQ(::mkfifo(fresh.c_str(), 0600), 0);
  EXPECT_EQ(write_durably(fd.get(), "a", "last"), 0);
  EXPECT_EQ(directory.text_of("other"), "precious");
  EXPECT_EQ(directory.text_of("a"), "last");
  EXPECT_EQ(directory.names(), (std::set<std::string>{"a", "other"}));
}

TEST(WriteDurably, ReturnsErrors) {
  EXPECT_EQ(write_durably(-1, "a", "text"), EBADF);
  const Descriptor gone = [] {
    const test::TempDirectory directory;
    return Descriptor(::open(directory.path().c_str(), O_RDONLY | O_DIRECTORY));
  }();
  EXPECT_EQ(write_durably(gone.get(), "a", "text"), ENOENT);
}

/// A disk controlled by the test.
struct SlowDisk {
  std::counting_semaphore<> started{0};
  std::counting_semaphore<> may_go_on{0};
  std::atomic<int> error = 0;
  std::vector<std::string> texts;  // written by the writer thread; read after its end

  RomWriter::WriteFile write() {
    return [this](int, const std::string&, const std::string& text) {
      started.release();
      may_go_on.acquire();
      texts.push_back(text);
      return error.load();
    };
  }
};

struct Done {
  int id;
  std::uint64_t number;
  int error;
  friend bool operator==(const Done&, const Done&) = default;
};

/// Reports of a writer, in order.
struct Reports {
  std::vector<Done> done;
  std::counting_semaphore<> reported{0};

  RomWriter::OnWritten add() {
    return [this](const RomFile& place, const RomWrite& write, int error) {
      done.push_back({place.owner.id, write.number, error});
      reported.release();
    };
  }
  void await(int count) {
    for (int n = 0; n < count; ++n) reported.acquire();
  }
};

const RomFile kOne{-1, "one", 0, {"vcan0", 1, "m"}};
const RomFile kTwo{-1, "two", 0, {"vcan0", 2, "m"}};

TEST(RomWriter, MergesQueuedWritesIntoTheLast) {
  SlowDisk disk;
  Reports reports;
  {
    RomWriter writer(reports.add(), disk.write());
    writer.write(kOne, rom_write(1, 1));
    disk.started.acquire();  // in progress: later writes must wait
    writer.write(kTwo, rom_write(2, 1));
    writer.write(kOne, rom_write(1, 2));
    writer.write(kTwo, rom_write(2, 2));
    writer.write(kOne, rom_write(1, 3));
    disk.may_go_on.release(3);
    reports.await(3);
  }
  EXPECT_EQ(reports.done, (std::vector<Done>{{1, 1, 0}, {2, 2, 0}, {1, 3, 0}}));
  ASSERT_EQ(disk.texts.size(), 3U);
  EXPECT_NE(disk.texts[2].find("encoder_offset = 3\n"), std::string::npos) << disk.texts[2];
}

TEST(RomWriter, FinishesTheCurrentWriteBeforeItEnds) {
  SlowDisk disk;
  disk.error = ENOSPC;
  Reports reports;
  {
    RomWriter writer(reports.add(), disk.write());
    writer.write(kOne, rom_write(1, 1));
    disk.started.acquire();
    writer.write(kTwo, rom_write(2, 1));
    disk.may_go_on.release(2);
  }
  ASSERT_FALSE(reports.done.empty());
  EXPECT_EQ(reports.done.front(), (Done{1, 1, ENOSPC}));
}

TEST(RomWriter, FailsWritesUntilAThreadStarts) {
  Reports reports;
  {
    RomWriter writer(reports.add(), [](int, const std::string&, const std::string&) { return 0; });
    {
      const test::NoThreads none;
      writer.write(kOne, rom_write(1, 1));
      writer.write(kOne, rom_write(1, 2));
    }
    writer.write(kOne, rom_write(1, 3));
    reports.await(3);
  }
  // pthread_create(3) fails with EAGAIN in this case.
  EXPECT_EQ(reports.done, (std::vector<Done>{{1, 1, EAGAIN}, {1, 2, EAGAIN}, {1, 3, 0}}));
}

TEST(RomWriter, StoresManyWritesOfManyDrives) {
  const test::TempDirectory directory;
  const Descriptor fd(::open(directory.path().c_str(), O_RDONLY | O_DIRECTORY));
  std::vector<RomFile> places;
  for (int id = 1; id <= 8; ++id) {
    places.push_back({fd.get(), std::to_string(id), 0, {"vcan0", id, "m"}});
  }
  constexpr int kWrites = 50;
  std::atomic<int> finished = 0;
  std::counting_semaphore<> all_done{0};
  RomWriter writer([&](const RomFile&, const RomWrite& write, int error) {
    EXPECT_EQ(error, 0);
    if (write.number == kWrites && ++finished == 8) all_done.release();
  });
  for (std::uint64_t n = 1; n <= kWrites; ++n) {
    for (const RomFile& place : places) writer.write(place, rom_write(place.owner.id, n));
  }
  all_done.acquire();
  for (const RomFile& place : places) {
    ServoConfig servo;
    servo.id = place.owner.id;
    servo.profile.name = "m";
    read_rom(directory.text_of(place.name), place.name, "vcan0", servo);
    EXPECT_EQ(servo.rom.encoder_offset, kWrites);
  }
}

}  // namespace rom_writer_test
}  // namespace lk::emulator
