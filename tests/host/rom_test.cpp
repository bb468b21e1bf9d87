// ROM that outlives the program: restarts, refusals, slow disks.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/host/emulator_process.hpp"
#include "tests/host/host.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::host {
namespace rom_test {

namespace fs = std::filesystem;

constexpr Payload kReadPid = {0x30};
constexpr Payload kReadEncoder = {0x90};
constexpr Payload kReadState2 = {0x9C};
constexpr Payload kWriteZero = {0x19};
constexpr Payload kPidToRam = {0x31, 0, 9, 8, 7, 6, 5, 4};
constexpr Payload kPidToRom = {0x32, 0, 1, 2, 3, 4, 5, 6};
constexpr Payload kPid = {0x30, 0, 1, 2, 3, 4, 5, 6};
constexpr Payload kFactoryPid = {0x30, 0, 100, 100, 50, 40, 50, 50};

class Rom : public testing::Test {
 protected:
  std::vector<std::string> arguments(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all = {"--bus", own_bus(), "--ids", "1-2", "--rom", directory_};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  std::string file(int id) const {
    return directory_ + '/' + own_bus() + '-' + std::to_string(id) + ".toml";
  }

  const test::TempDirectory own_;
  const std::string directory_ = own_.path().string();
};

TEST_F(Rom, KeepsRomGainsButNotRamGains) {
  {
    StartedEmulator emulator(arguments());
    Host host(own_bus());
    EXPECT_EQ(host.query(1, kPidToRom), kPidToRom);
    EXPECT_EQ(host.query(2, kPidToRam), kPidToRam);
    const auto result = emulator.stop();
    EXPECT_EQ(result.status, 0);
    EXPECT_NE(result.out.find("writes to ROM"), std::string::npos) << result.out;
  }
  EXPECT_NE(text_of(file(1)).find("gains = 1\n"), std::string::npos) << text_of(file(1));
  EXPECT_FALSE(fs::exists(file(2)));
  StartedEmulator emulator(arguments());
  Host host(own_bus());
  EXPECT_EQ(host.query(1, kReadPid), kPid);
  EXPECT_EQ(host.query(2, kReadPid), kFactoryPid);
}

TEST_F(Rom, AppliesTheZeroAfterRestart) {
  Payload written{};
  {
    StartedEmulator emulator(arguments());
    Host host(own_bus());
    const auto reply = host.query(1, kWriteZero);
    ASSERT_TRUE(reply);
    written = *reply;
    const auto now = host.query(1, kReadEncoder);
    ASSERT_TRUE(now);
    EXPECT_EQ((*now)[6] | (*now)[7], 0) << "not before the next power-up";
    EXPECT_EQ(emulator.stop().status, 0);
  }
  StartedEmulator emulator(arguments());
  Host host(own_bus());
  const auto reply = host.query(1, kReadEncoder);
  ASSERT_TRUE(reply);
  EXPECT_EQ((*reply)[6], written[6]);
  EXPECT_EQ((*reply)[7], written[7]);
  // The shaft starts at its previous angle, which is now zero, within its noise.
  const int encoder = (*reply)[2] | (*reply)[3] << 8;
  EXPECT_LT(std::min(encoder, 16384 - encoder), 20) << encoder;
}

TEST_F(Rom, WipeRestoresTheConfiguration) {
  {
    StartedEmulator emulator(arguments());
    EXPECT_TRUE(Host(own_bus()).query(1, kPidToRom));
  }
  std::ofstream(file(2)) << "damaged";
  StartedEmulator emulator(arguments({"--wipe-rom"}));
  EXPECT_TRUE(emulator.wait_for_log(own_bus() + ":1: ROM wiped, " + file(1) + " removed"));
  EXPECT_TRUE(emulator.wait_for_log(own_bus() + ":2: ROM wiped, " + file(2) + " removed"));
  EXPECT_EQ(Host(own_bus()).query(1, kReadPid), kFactoryPid);
  EXPECT_FALSE(fs::exists(file(1)));
}

TEST_F(Rom, IsNotWipedByAFailedStart) {
  {
    StartedEmulator emulator(arguments());
    EXPECT_EQ(Host(own_bus()).query(1, kPidToRom), kPidToRom);
    EXPECT_EQ(emulator.stop().status, 0);
  }
  const std::string before = text_of(file(1));
  for (const std::vector<std::string>& refused :
       {std::vector<std::string>{"--control", directory_ + "/none/s"},
        {"--http", "192.0.2.1:80"},  // unassigned address (RFC 5737)
        {"--record", directory_}}) {
    std::vector<std::string> all = arguments({"--wipe-rom"});
    all.insert(all.end(), refused.begin(), refused.end());
    const auto result = EmulatorProcess(all).wait();
    EXPECT_EQ(result.status, 2) << refused[0];
    EXPECT_EQ(result.err.find("wiped"), std::string::npos) << result.err;
    EXPECT_EQ(text_of(file(1)), before) << refused[0];
  }
}

TEST_F(Rom, RejectsAndKeepsDamagedFiles) {
  std::ofstream(file(2)) << "format = 1\nbus = \"" + own_bus() + "\"\nid = 2\nmotor = 7\n";
  const std::string before = text_of(file(2));
  expect_refused(
      EmulatorProcess(arguments()),
      "lk-emu: " + file(2) +
          ":4: motor: must be a string (give another --rom DIR, or reset it with --wipe-rom)\n");
  EXPECT_EQ(text_of(file(2)), before);
}

TEST_F(Rom, NamesTheHolderOfTheDirectory) {
  StartedEmulator first(arguments());
  expect_refused(EmulatorProcess({"--bus", own_bus(1), "--ids", "1", "--rom", directory_}),
                 "lk-emu: " + directory_ + " is in use by lk-emu (pid " +
                     std::to_string(first.pid()) + "); stop it, or give another --rom DIR\n");
  first.signal(SIGKILL);
  first.wait();
  EmulatorProcess third(arguments());
  EXPECT_TRUE(third.wait_ready()) << "a killed program holds nothing";
}

TEST_F(Rom, DefaultsToTheStateDirectoryPerBus) {
  const std::vector<std::string> state = {"env", "XDG_STATE_HOME=" + directory_};
  EmulatorProcess first({"--bus", own_bus(), "--ids", "1"}, state);
  EmulatorProcess second({"--bus", own_bus(1), "--ids", "1"}, state);
  ASSERT_TRUE(first.wait_ready());
  ASSERT_TRUE(second.wait_ready()) << "programs on different buses do not meet";
  EXPECT_EQ(Host(own_bus(1)).query(1, kPidToRom), kPidToRom);
  EXPECT_TRUE(fs::exists(directory_ + "/lk-emu/" + own_bus(1) + '/' + own_bus(1) + "-1.toml"));
  const auto third = EmulatorProcess({"--bus", own_bus(1), "--ids", "7"}, state).wait();
  EXPECT_NE(third.err.find("lk-emu/" + own_bus(1) + " is in use by lk-emu (pid "),
            std::string::npos)
      << third.err;
}

TEST_F(Rom, RequiresAnOptionWithoutADefaultDirectory) {
  expect_refused(
      EmulatorProcess({"--bus", own_bus(), "--ids", "1"},
                      {"env", "-u", "HOME", "-u", "XDG_STATE_HOME"}),
      "lk-emu: no directory for ROM: neither HOME nor XDG_STATE_HOME is set; give --rom DIR, "
      "or --rom :memory:\n");
}

TEST_F(Rom, InMemoryLeavesNoFiles) {
  const std::vector<std::string> arguments = {"--bus", own_bus(), "--ids",
                                              "1",     "--rom",   ":memory:"};
  const std::vector<std::string> state = {"env", "-C", directory_, "HOME=" + directory_,
                                          "XDG_STATE_HOME=" + directory_};
  {
    StartedEmulator emulator(arguments, state);
    EXPECT_EQ(Host(own_bus()).query(1, kPidToRom), kPidToRom);
    EXPECT_EQ(emulator.stop().status, 0);
  }
  EXPECT_TRUE(fs::is_empty(directory_));
  StartedEmulator emulator(arguments, state);
  EXPECT_EQ(Host(own_bus()).query(1, kReadPid), kFactoryPid);
}

/// The real program on a disk whose fsync waits for `SlowDisk::go_on` (slow_disk.cpp).
class SlowDisk : public Rom {
 protected:
  SlowDisk() : fifo_(directory_ + "/disk") { EXPECT_TRUE(run("mkfifo " + fifo_)); }
  std::vector<std::string> launcher() const {
    return {"env", "LD_PRELOAD=" LKEMU_SLOW_DISK, "LKEMU_SLOW_DISK=" + fifo_};
  }
  /// Unblocks the disk.
  void go_on() const { std::ofstream(fifo_) << std::string(100, '.'); }

  std::string fifo_;
};

TEST_F(SlowDisk, DelaysOnlyTheWritingDrive) {
  StartedEmulator emulator(arguments(), launcher());
  Host host(own_bus());
  host.send(0x141, kPidToRom);
  host.send(0x141, kReadState2);
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(host.query(2, kReadState2)) << "a reply of drive 1, or none at all";
  }
  go_on();
  for (const std::uint8_t command : {std::uint8_t{0x32}, std::uint8_t{0x9C}}) {
    const auto reply = host.receive();
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->can_id, 0x141U);
    EXPECT_EQ(reply->data[0], command);
  }
  EXPECT_EQ(emulator.stop().status, 0);
}

TEST_F(SlowDisk, StopWaitsAndAcknowledges) {
  StartedEmulator emulator(arguments(), launcher());
  Host host(own_bus());
  host.send(0x141, kPidToRom);
  // When drive 2 has answered this later query, the write is in progress.
  ASSERT_TRUE(host.query(2, kReadState2));
  ASSERT_TRUE(emulator.wait_for_log("writing"));
  emulator.signal(SIGTERM);
  go_on();
  const auto reply = host.receive();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->data[0], 0x32);
  EXPECT_EQ(emulator.wait().status, 0);
  EXPECT_NE(text_of(file(1)).find("gains = 1\n"), std::string::npos);
}

TEST_F(SlowDisk, StopDoesNotWaitForABlockedDisk) {
  StartedEmulator emulator(arguments(), launcher());
  Host host(own_bus());
  host.send(0x141, kPidToRom);
  ASSERT_TRUE(host.query(2, kReadState2));
  ASSERT_TRUE(emulator.wait_for_log("writing"));
  const auto result = emulator.stop();  // the disk stays blocked
  EXPECT_EQ(result.status, 0);
  EXPECT_NE(result.out.find("whose last ROM write is not confirmed"), std::string::npos)
      << result.out;
  EXPECT_FALSE(fs::exists(file(1)));
  EmulatorProcess next(arguments());
  ASSERT_TRUE(next.wait_ready()) << "it holds nothing";
  EXPECT_EQ(Host(own_bus()).query(1, kReadPid), kFactoryPid);
}

TEST_F(SlowDisk, VerdictDoesNotWaitForABlockedDisk) {
  const std::string scenario = directory_ + "/scenario.toml";
  std::ofstream(scenario) << "robot = \"somewhere_else\"\nduration_s = 0.2\n"
                             "[[send]]\nat_s = 0\nframe = \"141#3200010203040506\"\n"
                             "[[expect]]\nid = 2\nstate = \"running\"\n";
  const auto result =
      EmulatorProcess(arguments({"--scenario", scenario, "--junit", "/dev/full"}), launcher())
          .wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.out.find("whose last ROM write is not confirmed"), std::string::npos)
      << result.out;
  EXPECT_NE(result.err.find("lk-emu: --junit: cannot write /dev/full: No space left on device\n"),
            std::string::npos)
      << result.err;
}

TEST_F(SlowDisk, SecondSignalEndsTheWait) {
  StartedEmulator emulator(arguments(), launcher());
  Host(own_bus()).send(0x141, kPidToRom);
  ASSERT_TRUE(emulator.wait_for_log("writing"));
  emulator.signal(SIGTERM);
  const auto result = emulator.stop(SIGINT);
  EXPECT_EQ(result.status, 0);
  EXPECT_NE(result.out.find("whose last ROM write is not confirmed"), std::string::npos)
      << result.out;
}

}  // namespace rom_test
}  // namespace lk::host
