// Files with limited size and logs that cannot be written; remains of failed starts, signals and
// kills.

#include <algorithm>
#include <csignal>

#include "tests/host/disk_support.hpp"

namespace lk::host {
namespace disk_test {

namespace fs = std::filesystem;

using Disk = DiskTest;

/// Limits file sizes, as `ulimit -f` does.
std::vector<std::string> no_file_longer_than(const std::string& bytes) {
  return {"prlimit", "--fsize=" + bytes};
}

TEST_F(Disk, ReportsFileSizeLimit) {
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

TEST_F(Disk, FileSizeLimitEndsOnlyTheRecording) {
  expect_recording_to_end(path("recording"), "File too large", no_file_longer_than("20000"));
}

TEST_F(Disk, SignalLeavesNoPartialFiles) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    EmulatorProcess emulator({"run", scenario("100000"), "--csv", path("disk") + "/out.csv",
                              "--candump", path("disk") + "/out.log", "--junit",
                              path("disk") + "/out.xml"});
    // While it runs, a file contains more than its header.
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

TEST_F(Disk, ServesDrivesWithAnUnwritableLog) {
  StartedEmulator emulator(arguments({"--log-level", "trace"}),
                           {"sh", "-c", "exec \"$@\" 2>/dev/full", "sh"});
  Host host(bus_);
  emulator.signal(SIGSTOP);
  emulator.signal(SIGCONT);
  for (int n = 0; n < 100; ++n) ASSERT_TRUE(host.query(1, kReadState2));
  EXPECT_EQ(emulator.stop().status, 0);
}

// --- remains

TEST_F(Disk, FailedStartLeavesNoFiles) {
  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{"--http", "127.0.0.1x:0"},
        {"--http", "192.0.2.1:80"},  // reserved for documentation (RFC 5737)
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

TEST_F(Disk, RemovesSocketsOfKilledPrograms) {
  const std::vector<std::string> environment = {"env", "XDG_RUNTIME_DIR=" + directory_};
  const std::vector<std::string> plain = {"--rom", ":memory:", "--bus", bus_, "--ids", "1"};
  const auto sockets = [this] {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(path("lk-emu"))) {
      names.push_back(entry.path().filename());
    }
    return names;
  };
  for (int n = 0; n < 3; ++n) {
    StartedEmulator emulator(plain, environment);
    const std::string own = bus_ + '-' + std::to_string(emulator.pid()) + ".sock";
    EXPECT_EQ(sockets(), std::vector<std::string>{own}) << "start " << n;
    StartedEmulator other({"--rom", ":memory:", "--bus", own_bus(1), "--ids", "1"}, environment);
    EXPECT_EQ(sockets().size(), 2U) << "a live one stays";
    EXPECT_EQ(other.stop().status, 0);
    EXPECT_EQ(emulator.stop(SIGKILL).status, 128 + SIGKILL);
    EXPECT_EQ(sockets(), std::vector<std::string>{own});
  }
}

}  // namespace disk_test
}  // namespace lk::host
