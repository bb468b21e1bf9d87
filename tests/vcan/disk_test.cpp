// Disks that are full, end too soon or may not be written, for everything that is written; and what
// starts that fail, signals and kills leave behind.

#include <algorithm>
#include <csignal>

#include "tests/vcan/machine_support.hpp"

namespace lk::vcan {
namespace disk_test {

namespace fs = std::filesystem;

constexpr Payload kPidToRom = {0x32, 0, 1, 2, 3, 4, 5, 6};
constexpr Payload kReadPid = {0x30};
constexpr Payload kPid = {0x30, 0, 1, 2, 3, 4, 5, 6};

class Disk : public MachineTest {
 protected:
  Disk() { fs::create_directory(path("disk")); }
  ~Disk() override { run("umount " + path("disk") + " 2>/dev/null"); }

  /// A disk of its own with so much on it.
  std::string disk(const std::string& options) const {
    EXPECT_TRUE(run("mount -t tmpfs -o mode=755," + options + " none " + path("disk")));
    return path("disk");
  }
  void fill() const { run("head -c 10000000 /dev/zero >" + path("disk") + "/filler 2>/dev/null"); }
  /// One that asks and expects; `more` goes into it.
  std::string scenario(const std::string& duration_s) const {
    std::ofstream(path("robot.toml"))
        << "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nids = \"1-4\"\n";
    std::ofstream(path("scenario.toml"))
        << "robot = \"robot.toml\"\nduration_s = " << duration_s
        << "\n[[send]]\nat_s = 0\nid = 1\ncommand = \"state_2\"\nevery_s = 0.001\n"
           "[[expect]]\nid = 1\nsignal = \"alive\"\nmin = 1\n";
    return path("scenario.toml");
  }
  std::vector<std::string> names_on_disk() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(path("disk"))) {
      if (entry.path().filename() != "filler") names.push_back(entry.path().filename());
    }
    return names;
  }
};

/// With no file of it longer than this, as `ulimit -f` does.
std::vector<std::string> no_file_longer_than(const std::string& bytes) {
  return {"prlimit", "--fsize=" + bytes};
}

// --- lk-emu run

TEST_F(Disk, AFullOneIsSaidOnceByARunAndLeavesNothingHalf) {
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

TEST_F(Disk, ALimitOfTheFileSizeIsNoCrash) {
  for (const std::string option : {"--csv", "--candump", "--junit"}) {
    const std::string file = path("disk") + "/out";
    const auto result =
        EmulatorProcess({"run", scenario("5"), option, file, "--quiet"}, no_file_longer_than("100"))
            .wait();
    EXPECT_EQ(result.status, 2) << option;
    EXPECT_EQ(result.err, "lk-emu: " + option + ": cannot write " + file + ": File too large\n");
    EXPECT_EQ(names_on_disk(), std::vector<std::string>{}) << option;
  }
}

TEST_F(Disk, ASignalLeavesNothingHalf) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    EmulatorProcess emulator({"run", scenario("100000"), "--csv", path("disk") + "/out.csv",
                              "--candump", path("disk") + "/out.log", "--junit",
                              path("disk") + "/out.xml"});
    // Once it runs, there is more in a file than its header.
    ASSERT_TRUE(wait_until([&] {
      const auto names = names_on_disk();
      return names.size() == 3 && std::ranges::any_of(names, [&](const std::string& name) {
               std::error_code gone;
               return fs::file_size(path("disk") + "/" + name, gone) > 1000;
             });
    }));
    EXPECT_EQ(emulator.stop(number).status, 128 + number);
    EXPECT_EQ(names_on_disk(), std::vector<std::string>{}) << "signal " << number;
  }
}

// --- the running program

/// Keeps a drive answering until the log says `text`; false when it does not answer.
bool talk_until_log(Host& host, const std::string& text, const std::string& log) {
  bool answered = true;
  const bool over = wait_until([&] {
    for (int n = 0; n < 20 && answered; ++n) answered = host.query(1, kReadState2).has_value();
    return !answered || text_of(log).find(text) != std::string::npos;
  });
  return over && answered;
}

class RunningDisk : public Disk {
 protected:
  /// The log goes to a file: a test that talks cannot read a pipe.
  std::vector<std::string> logging() const {
    return {"sh", "-c", "exec \"$@\" 2>" + path("log"), "sh"};
  }
};

TEST_F(RunningDisk, ARecordingEndsWhereItIsRefusedAndSaysSoOnce) {
  // As `ulimit -f` does, and as a disk does that is full.
  for (const bool limited : {true, false}) {
    const std::string recording = limited ? path("limited") : path("disk") + "/recording";
    if (!limited) disk("size=256k");
    std::vector<std::string> launcher = logging();
    if (limited) launcher.insert(launcher.begin(), {"prlimit", "--fsize=100000"});
    EmulatorProcess emulator(arguments({"--record", recording}), launcher);
    ASSERT_TRUE(emulator.wait_ready());
    Host host("vcan0");
    const std::string why = limited ? "File too large" : "No space left on device";
    ASSERT_TRUE(talk_until_log(host, "has ended: " + why, path("log")));
    EXPECT_NE(get("/status").body.find("\"failed\":true"), std::string::npos);
    for (int n = 0; n < 100; ++n) ASSERT_TRUE(host.query(2, kReadState2)) << "drives go on";
    EXPECT_EQ(emulator.stop().status, 0);
    EXPECT_EQ(count_of(text_of(path("log")), "has ended"), 1);
    const auto again = EmulatorProcess({"replay", recording}).wait();
    EXPECT_EQ(again.status, 0) << again.err;
    EXPECT_NE(again.out.find("identical up to "), std::string::npos) << again.out;
  }
}

TEST_F(RunningDisk, AVerdictThatCannotBeWrittenIsSaidAndPrintedAllTheSame) {
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

TEST_F(RunningDisk, ALogThatCannotBeWrittenIsMissed) {
  EmulatorProcess emulator(arguments({"--log-level", "trace"}),
                           {"sh", "-c", "exec \"$@\" 2>/dev/full", "sh"});
  ASSERT_TRUE(emulator.wait_ready());
  Host host("vcan0");
  emulator.signal(SIGSTOP);
  emulator.signal(SIGCONT);
  for (int n = 0; n < 100; ++n) ASSERT_TRUE(host.query(1, kReadState2));
  EXPECT_EQ(emulator.stop().status, 0);
}

TEST_F(RunningDisk, RomThatMayNotBeWrittenAnyMoreIsNotAcknowledged) {
  disk("size=1m,mode=777");
  fs::permissions(path(""), fs::perms(0755));
  // Nobody is stopped by permissions who is root.
  EmulatorProcess emulator(
      {"--rom", path("disk") + "/rom", "--control", "none", "--bus", "vcan0", "--ids", "1-2"},
      as_another_user());
  ASSERT_TRUE(emulator.wait_ready());
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
  EmulatorProcess next(
      {"--rom", path("disk") + "/rom", "--control", "none", "--bus", "vcan0", "--ids", "1-2"});
  ASSERT_TRUE(next.wait_ready());
  EXPECT_EQ(host.query(1, kReadPid), kPid) << "the last that was acknowledged";
  EXPECT_EQ(host.query(2, kReadPid), kPid);
}

// What a remount may not do to a program that keeps a file open for writing, its lock.
TEST_F(RunningDisk, UnderARunningOneTheDiskCannotBeMadeReadOnly) {
  disk("size=1m");
  EmulatorProcess emulator(
      {"--rom", path("disk"), "--control", "none", "--bus", "vcan0", "--ids", "1"});
  ASSERT_TRUE(emulator.wait_ready());
  EXPECT_FALSE(run("mount -o remount,ro " + path("disk") + " 2>/dev/null"));
  Host host("vcan0");
  EXPECT_EQ(host.query(1, kPidToRom), kPidToRom);
  EXPECT_EQ(emulator.stop().status, 0);
  EXPECT_TRUE(run("mount -o remount,ro " + path("disk"))) << "as soon as it has ended";
}

TEST_F(RunningDisk, AReadOnlyDirectoryForRomIsRefusedAtTheStart) {
  disk("ro");
  const auto result =
      EmulatorProcess({"--rom", path("disk"), "--control", "none", "--bus", "vcan0", "--ids", "1"})
          .wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.err, "lk-emu: cannot keep ROM in " + path("disk") + ": Read-only file system\n");
}

// --- what is left behind

TEST_F(Disk, AStartThatFailsLeavesNothing) {
  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{"--http", "127.0.0.1x:0"},
        {"--http", "192.0.2.1:80"},  // an address of nobody (RFC 5737)
        {"--http", "127.0.0.1:0", "--http-token", "/none"}}) {
    std::vector<std::string> more = {"--record",    path("recording"), "--junit",
                                     path("j.xml"), "--scenario",      scenario("1")};
    more.insert(more.end(), wrong.begin(), wrong.end());
    EXPECT_EQ(EmulatorProcess(arguments(more)).wait().status, 2) << wrong[1];
    for (const char* name : {"s", "recording", "j.xml"}) {
      EXPECT_FALSE(fs::exists(path(name))) << name << " with " << wrong[1];
    }
  }
}

TEST_F(Disk, WhatAKilledProgramLeftIsClearedAway) {
  const std::vector<std::string> environment = {"env", "XDG_RUNTIME_DIR=" + directory_};
  const std::vector<std::string> plain = {"--rom", ":memory:", "--bus", "vcan0", "--ids", "1"};
  const auto sockets = [this] {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(path("lk-emu"))) {
      names.push_back(entry.path().filename());
    }
    return names;
  };
  for (int n = 0; n < 3; ++n) {
    EmulatorProcess emulator(plain, environment);
    ASSERT_TRUE(emulator.wait_ready());
    const std::string own = "vcan0-" + std::to_string(emulator.pid()) + ".sock";
    EXPECT_EQ(sockets(), std::vector<std::string>{own}) << "start " << n;
    EmulatorProcess other({"--rom", ":memory:", "--bus", "vcan1", "--ids", "1"}, environment);
    ASSERT_TRUE(other.wait_ready());
    EXPECT_EQ(sockets().size(), 2U) << "a live one stays";
    EXPECT_EQ(other.stop().status, 0);
    EXPECT_EQ(emulator.stop(SIGKILL).status, 128 + SIGKILL);
    EXPECT_EQ(sockets(), std::vector<std::string>{own});
  }
}

}  // namespace disk_test
}  // namespace lk::vcan
