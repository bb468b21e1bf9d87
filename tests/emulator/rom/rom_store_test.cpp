#include "emulator/files/rom_store.hpp"

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <optional>

#include "emulator/core/start_error.hpp"
#include "tests/emulator/rom/rom_support.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::emulator {
namespace rom_store_test {

std::vector<BusConfig> one_drive() {
  BusConfig bus;
  bus.interface = "vcan0";
  ServoConfig servo;
  servo.id = 1;
  servo.profile.name = "m";
  bus.servos.push_back(servo);
  return {bus};
}

RomOptions in(const std::filesystem::path& path) {
  RomOptions options;
  options.directory = path;
  return options;
}

std::string refusal(const RomOptions& options) {
  auto buses = one_drive();
  try {
    const RomStore store(options, buses);
  } catch (const StartError& problem) {
    return problem.what();
  }
  return "accepted";
}

/// Stores the `number`-th write of drive 1 in `directory`.
void keep(const test::TempDirectory& directory, std::uint64_t number) {
  const RomWrite write = rom_write(1, number);
  directory.put("vcan0-1.toml", print_rom({"vcan0", 1, "m"}, write.rom, write.wear));
}

TEST(RomStore, RestrictsItsDirectoryToTheUser) {
  const test::TempDirectory directory;
  const auto path = directory.path() / "a" / "b";
  auto buses = one_drive();
  const RomStore store(in(path), buses);
  struct stat status {};
  ASSERT_EQ(::stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0700U);
  EXPECT_EQ(buses[0].servos[0].wear, RomWear{});
}

TEST(RomStore, FilesOverrideTheConfiguration) {
  const test::TempDirectory directory;
  keep(directory, 7);
  auto buses = one_drive();
  buses[0].servos[0].rom.gains.angle_kp = 5;
  const RomStore store(in(directory.path()), buses);
  EXPECT_EQ(buses[0].servos[0].rom.encoder_offset, 7);
  EXPECT_EQ(buses[0].servos[0].rom.gains.angle_kp, 5);
  EXPECT_EQ(store.place(0, 1).name, "vcan0-1.toml");
}

TEST(RomStore, IgnoresUnfinishedFiles) {
  const test::TempDirectory directory;
  keep(directory, 7);
  directory.put("vcan0-1.toml.new", "half of");
  auto buses = one_drive();
  const RomStore store(in(directory.path()), buses);
  EXPECT_EQ(buses[0].servos[0].rom.encoder_offset, 7);
  EXPECT_EQ(directory.names(), (std::set<std::string>{"lock", "vcan0-1.toml"}));
}

TEST(RomStore, RejectsAndKeepsDamagedFiles) {
  const test::TempDirectory directory;
  directory.put("vcan0-1.toml", "format = 1\nbus = \"vcan1\"\nid = 1\nmotor = \"m\"\n");
  const std::string file = (directory.path() / "vcan0-1.toml").string();
  EXPECT_EQ(refusal(in(directory.path())),
            file +
                ":2: bus: this is the ROM of vcan1:1, motor m, not of vcan0:1, motor m (give "
                "another --rom DIR, or reset it with --wipe-rom)");
  EXPECT_TRUE(directory.text_of("vcan0-1.toml").starts_with("format = 1\nbus = \"vcan1\""));
  std::filesystem::remove(file);
  std::filesystem::create_directory(file);
  EXPECT_EQ(refusal(in(directory.path())), file + ": is a directory");
}

TEST(RomStore, WipeRemovesFilesOfItsDrivesOnly) {
  const test::TempDirectory directory;
  directory.put("vcan0-1.toml", "damaged");
  directory.put("vcan0-2.toml", "of a drive that does not run");
  auto options = in(directory.path());
  options.wipe = true;
  auto buses = one_drive();
  RomStore store(options, buses);
  EXPECT_EQ(directory.text_of("vcan0-1.toml"), "damaged") << "not before it is said";
  store.wipe();
  EXPECT_EQ(directory.names(), (std::set<std::string>{"lock", "vcan0-2.toml"}));
}

TEST(RomStore, LocksItsDirectory) {
  const test::TempDirectory directory;
  auto buses = one_drive();
  std::optional<RomStore> store(std::in_place, in(directory.path()), buses);
  EXPECT_EQ(refusal(in(directory.path())),
            directory.path().string() + " is in use by lk-emu (pid " + std::to_string(::getpid()) +
                "); stop it, or give another --rom DIR");
  store.reset();
  EXPECT_EQ(refusal(in(directory.path())), "accepted") << "the file stays, the lock does not";
}

/// A directory from a third party's archive may contain its own lock.
TEST(RomStore, RejectsAndKeepsForeignLockFiles) {
  const test::TempDirectory directory;
  const std::string other = directory.put("other", "precious");
  const std::string lock = directory.path("lock");
  std::filesystem::create_symlink(other, lock);
  EXPECT_EQ(refusal(in(directory.path())), lock + " is a link: remove it");
  std::filesystem::remove(lock);
  std::filesystem::create_hard_link(other, lock);
  EXPECT_EQ(refusal(in(directory.path())), lock + " is not a file of lk-emu's own: remove it");
  std::filesystem::remove(lock);
  ASSERT_EQ(::mkfifo(lock.c_str(), 0600), 0);
  EXPECT_EQ(refusal(in(directory.path())), lock + " is not a file of lk-emu's own: remove it");
  EXPECT_EQ(directory.text_of("other"), "precious");
}

TEST(RomStore, RejectsDirectoriesWritableByOthers) {
  const test::TempDirectory directory;
  const std::string name = directory.path().string();
  for (const mode_t mode : {0720U, 0702U}) {
    ::chmod(name.c_str(), mode);
    EXPECT_EQ(refusal(in(name)), name + " may be written by others: chmod go-w " + name);
  }
  ::chmod(name.c_str(), 0755);
  EXPECT_EQ(refusal(in(name)), "accepted");
}

TEST(RomStore, RejectsPipesAndEndlessFiles) {
  const test::TempDirectory directory;
  const std::string file = directory.path("vcan0-1.toml");
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  EXPECT_EQ(refusal(in(directory.path())), file + ": is not a regular file");
  std::filesystem::remove(file);
  std::filesystem::create_symlink("/dev/zero", file);
  EXPECT_EQ(refusal(in(directory.path())), file + ": is not a regular file");
  std::filesystem::remove(file);
  directory.put("vcan0-1.toml", std::string(65'537, '#'));
  EXPECT_EQ(refusal(in(directory.path())), file + ": is longer than 65536 bytes");
}

TEST(RomStore, ReportsUnusableDirectories) {
  EXPECT_EQ(refusal(in("/dev/null")), "cannot keep ROM in /dev/null: Not a directory");
  EXPECT_EQ(refusal(in("/proc/none/x")),
            "cannot keep ROM in /proc/none/x: No such file or directory");
}

/// Permissions do not stop root.
TEST(RomStore, RejectsAUsedDirectoryWithoutWriteAccess) {
  const test::TempDirectory directory;
  const bool root = ::geteuid() == 0;
  constexpr uid_t kNobody = 65534;
  if (root) {
    ASSERT_EQ(::chown(directory.path().c_str(), kNobody, kNobody), 0);
    ASSERT_EQ(::seteuid(kNobody), 0);
  }
  const std::string used = refusal(in(directory.path()));
  ::chmod(directory.path().c_str(), 0500);
  const std::string closed = refusal(in(directory.path()));
  if (root) {
    ASSERT_EQ(::seteuid(0), 0);
    ::prctl(PR_SET_DUMPABLE, 1);  // the kernel cleared it; the leak checker needs it
  }
  EXPECT_EQ(used, "accepted");
  EXPECT_EQ(closed, "cannot keep ROM in " + directory.path().string() + ": Permission denied");
  ::chmod(directory.path().c_str(), 0700);
}

TEST(StateDirectory, FollowsTheXdgBaseDirectories) {
  EXPECT_EQ(state_directory("/state", "/home/me"), "/state/lk-emu");
  EXPECT_EQ(state_directory("relative", "/home/me"), "/home/me/.local/state/lk-emu");
  EXPECT_EQ(state_directory("", "/home/me"), "/home/me/.local/state/lk-emu");
  EXPECT_EQ(state_directory(nullptr, "/home/me"), "/home/me/.local/state/lk-emu");
  EXPECT_EQ(state_directory(nullptr, ""), "");
  EXPECT_EQ(state_directory(nullptr, nullptr), "");
}

}  // namespace rom_store_test
}  // namespace lk::emulator
