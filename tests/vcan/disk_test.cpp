// Full and read-only disks, for all written files. The test mounts them as root in its own machine.

#include <algorithm>

#include "tests/host/disk_support.hpp"
#include "tests/vcan/ready_emulator.hpp"

namespace lk::host {
namespace disk_test {

namespace fs = std::filesystem;

constexpr Payload kPidToRom = {0x32, 0, 1, 2, 3, 4, 5, 6};
constexpr Payload kReadPid = {0x30};
constexpr Payload kPid = {0x30, 0, 1, 2, 3, 4, 5, 6};

class Disk : public DiskTest {
 protected:
  Disk() : DiskTest("vcan0") {}
  ~Disk() override { run("umount " + path("disk") + " 2>/dev/null"); }

  /// Mounts a private disk with these options.
  void disk(const std::string& options) const {
    ASSERT_TRUE(run("mount -t tmpfs -o mode=755," + options + " none " + path("disk")));
  }
  void fill() const { run("head -c 10000000 /dev/zero >" + path("disk") + "/filler 2>/dev/null"); }
  std::vector<std::string> with_rom() const {
    return {"--rom", path("disk") + "/rom", "--control", "none", "--bus", bus_, "--ids", "1-2"};
  }
};

// --- lk-emu run

TEST_F(Disk, FullDiskIsReportedOnceAndLeavesNoPartialFiles) {
  disk("size=32k");
  fill();
  for (const std::string option : {"--csv", "--candump", "--junit"}) {
    const std::string file = path("disk") + "/out";
    const auto result = EmulatorProcess({"run", scenario("5"), option, file, "--quiet"}).wait();
    EXPECT_EQ(result.status, 2) << option;
    EXPECT_EQ(result.err,
              "lk-emu: " + option + ": cannot write " + file + ": No space left on device\n");
    EXPECT_EQ(names_on_disk(), std::vector<std::string>{}) << option;
  }
}

// --- the running program

TEST_F(Disk, FullDiskEndsOnlyTheRecording) {
  disk("size=256k");
  expect_recording_to_end(path("disk") + "/recording", "No space left on device");
}

TEST_F(Disk, PrintsTheVerdictDespiteAFailedReport) {
  disk("size=32k");
  fill();
  const auto result = EmulatorProcess(arguments({"--scenario", scenario("0.2"), "--junit",
                                                 path("disk") + "/out.xml"}))
                          .wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.err.find("lk-emu: --junit: cannot write " + path("disk") +
                            "/out.xml: No space left on device\n"),
            std::string::npos)
      << result.err;
  EXPECT_NE(result.out.find("passed"), std::string::npos) << result.out;
  EXPECT_EQ(names_on_disk(), std::vector<std::string>{});
}

TEST_F(Disk, LostWriteAccessToRomPreventsAcknowledgement) {
  disk("size=1m,mode=777");
  fs::permissions(path(""), fs::perms(0755));
  // Permissions do not stop root.
  ReadyEmulator emulator(with_rom(), as_another_user());
  Host host("vcan0");
  ASSERT_EQ(host.query(1, kPidToRom), kPidToRom);
  ASSERT_TRUE(run("chmod 500 " + path("disk") + "/rom"));
  host.send(0x141, {0x32, 0, 99, 99, 99, 99, 99, 99});
  ASSERT_TRUE(emulator.wait_for_log(
      "vcan0:1: ROM not written: Permission denied; the drive continues with RAM"));
  EXPECT_EQ(host.query(1, kReadPid), (Payload{0x30, 0, 99, 99, 99, 99, 99, 99}));
  ASSERT_TRUE(run("chmod 700 " + path("disk") + "/rom"));
  EXPECT_EQ(host.query(2, kPidToRom), kPidToRom) << "and it may be written again";
  EXPECT_EQ(emulator.stop().status, 0);
  ReadyEmulator next(with_rom());
  EXPECT_EQ(host.query(1, kReadPid), kPid) << "the last that was acknowledged";
  EXPECT_EQ(host.query(2, kReadPid), kPid);
}

TEST_F(Disk, FullDiskPreventsOnlyRomAcknowledgements) {
  disk("size=64k");
  {
    ReadyEmulator emulator(with_rom());
    Host host("vcan0");
    EXPECT_EQ(host.query(1, kPidToRom), kPidToRom);
    fill();
    host.send(0x141, {0x32, 0, 99, 99, 99, 99, 99, 99});
    ASSERT_TRUE(emulator.wait_for_log(
        "vcan0:1: ROM not written: No space left on device; the drive continues with RAM"));
    EXPECT_EQ(host.query(1, kReadPid), (Payload{0x30, 0, 99, 99, 99, 99, 99, 99}))
        << "the next reply, since the write is not acknowledged";
    EXPECT_TRUE(host.query(2, kReadState2));
    const auto result = emulator.stop();
    EXPECT_EQ(result.status, 0);
    EXPECT_NE(result.out.find("writes to ROM that failed"), std::string::npos) << result.out;
    EXPECT_NE(result.out.find("replies not sent: not kept in ROM"), std::string::npos);
  }
  fs::remove(path("disk") + "/filler");
  ReadyEmulator emulator(with_rom());
  EXPECT_EQ(Host("vcan0").query(1, kReadPid), kPid) << "the last that was acknowledged";
}

// A remount is not possible while the program keeps its lock file open for writing.
TEST_F(Disk, RunningProgramPreventsAReadOnlyRemount) {
  disk("size=1m");
  ReadyEmulator emulator(
      {"--rom", path("disk"), "--control", "none", "--bus", "vcan0", "--ids", "1"});
  EXPECT_FALSE(run("mount -o remount,ro " + path("disk") + " 2>/dev/null"));
  Host host("vcan0");
  EXPECT_EQ(host.query(1, kPidToRom), kPidToRom);
  EXPECT_EQ(emulator.stop().status, 0);
  EXPECT_TRUE(run("mount -o remount,ro " + path("disk"))) << "as soon as it has ended";
}

TEST_F(Disk, RejectsAReadOnlyRomDirectory) {
  disk("ro");
  const auto result =
      EmulatorProcess({"--rom", path("disk"), "--control", "none", "--bus", "vcan0", "--ids", "1"})
          .wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.err, "lk-emu: cannot keep ROM in " + path("disk") + ": Read-only file system\n");
  const auto by_default =
      EmulatorProcess({"--bus", "vcan0", "--ids", "1"}, {"env", "XDG_STATE_HOME=" + path("disk")})
          .wait();
  EXPECT_EQ(by_default.status, 2);
  EXPECT_EQ(by_default.err,
            "lk-emu: cannot keep ROM in " + path("disk") +
                "/lk-emu/vcan0: Read-only file system; give --rom DIR, or --rom :memory:\n");
}

}  // namespace disk_test
}  // namespace lk::host
