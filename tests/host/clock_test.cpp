// Simulated time that differs from real time, and lk-emu ctl, with the real program.

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/host/emulator_process.hpp"
#include "tests/host/host.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::host {
namespace clock_test {

using Clock = std::chrono::steady_clock;

constexpr Payload kReadState2 = {0x9C};
constexpr Payload kReadPid = {0x30};

class WithControl : public testing::Test {
 protected:
  std::string socket() const { return directory_ + "/s"; }
  std::vector<std::string> arguments(const std::string& clock, const std::string& bitrate) const {
    return {"--rom",     ":memory:", "--control", socket(),  "--clock", clock,
            "--bitrate", bitrate,    "--bus",     own_bus(), "--ids",   "1-2"};
  }
  EmulatorProcess::Exit ctl(std::vector<std::string> words) const {
    words.insert(words.begin(), {"ctl", "--socket", socket()});
    return EmulatorProcess(words).wait();
  }
  /// Returns a number of the output of `lk-emu ctl --json`, by its key.
  double number(const std::string& command, const std::string& key) const {
    const std::string text = ctl({"--json", command}).out;
    const auto at = text.find("\"" + key + "\":");
    return at == std::string::npos ? -1 : std::stod(text.substr(at + key.size() + 3));
  }

  const test::TempDirectory own_;
  const std::string directory_ = own_.path().string();
};

TEST_F(WithControl, SteppedAnswersInOrderOnAdvance) {
  StartedEmulator emulator(arguments("stepped", "1000000"));
  Host host(own_bus());
  host.send(0x141, kReadState2);
  host.send(0x142, kReadPid);
  host.send(0x141, kReadPid);
  EXPECT_EQ(ctl({"advance", "0s"}).status, 0);
  EXPECT_FALSE(host.receive(0)) << "the wire takes time, and there was none";
  EXPECT_EQ(ctl({"advance", "10ms"}).status, 0);
  // All replies are in the socket already, so no patience is needed.
  std::vector<std::pair<canid_t, int>> replies;
  while (const auto reply = host.receive(0)) replies.emplace_back(reply->can_id, reply->data[0]);
  EXPECT_EQ(replies,
            (std::vector<std::pair<canid_t, int>>{{0x141, 0x9C}, {0x142, 0x30}, {0x141, 0x30}}));
  EXPECT_DOUBLE_EQ(number("clock", "time_s"), 0.01);
  EXPECT_EQ(emulator.stop().status, 0);
}

TEST_F(WithControl, SteppedAnswersOnAdvanceWithoutABitRate) {
  StartedEmulator emulator(arguments("stepped", "0"));
  Host host(own_bus());
  host.send(0x141, kReadState2);
  EXPECT_GE(number("status", "time_s"), 0) << "it has had its turn";
  EXPECT_FALSE(host.receive(0));
  EXPECT_EQ(ctl({"advance", "0s"}).status, 0);
  EXPECT_TRUE(host.receive(0)) << "frames take no time, and this is an instant";
}

/// More frames than the wire model's queue and the default receive buffer hold: the host reads
/// meanwhile.
TEST_F(WithControl, SteppedLosesNoFrames) {
  StartedEmulator emulator(arguments("stepped", "1000000"));
  Host host(own_bus());
  constexpr int kFrames = 5000;
  constexpr int kBurst = 100;
  for (int n = 0; n < kFrames; ++n) {
    host.send(0x141, n % 2 == 0 ? kReadState2 : kReadPid);
    // Gives the program time to empty its socket.
    if (n % kBurst == kBurst - 1) {
      ASSERT_GE(number("clock", "time_s"), 0);
    }
  }
  int replies = 0;
  for (int step = 0; replies < kFrames && step < 200; ++step) {
    ASSERT_EQ(ctl({"advance", "20ms"}).status, 0);
    for (auto reply = host.receive(0); reply; reply = host.receive(0), ++replies) {
      ASSERT_EQ(reply->data[0], replies % 2 == 0 ? 0x9C : 0x30) << replies;
    }
  }
  EXPECT_EQ(replies, kFrames);
}

TEST_F(WithControl, RunsTenTimesAsFast) {
  StartedEmulator emulator(arguments("x10", "1000000"));
  const double simulated = number("clock", "time_s");
  const auto wall = Clock::now();
  while (Clock::now() - wall < std::chrono::milliseconds(500)) number("clock", "time_s");
  const double passed_s = number("clock", "time_s") - simulated;
  const double wall_s = std::chrono::duration<double>(Clock::now() - wall).count();
  const double slipped_s = number("clock", "slipped_s");
  // Each reading starts a process, which takes time.
  EXPECT_LT(passed_s, 10 * (wall_s + 1));
  EXPECT_GT(passed_s + slipped_s, 10 * 0.4);
}

TEST_F(WithControl, SwitchesClockModeWithoutAJump) {
  StartedEmulator emulator(arguments("stepped", "1000000"));
  EXPECT_EQ(ctl({"advance", "2s"}).status, 0);
  EXPECT_EQ(ctl({"clock", "x0.001"}).status, 0);
  EXPECT_EQ(ctl({"clock", "stepped"}).status, 0);
  const double stands_s = number("clock", "time_s");
  EXPECT_GE(stands_s, 2);
  EXPECT_LT(stands_s, 2.1) << "a hundred seconds on the wall";
  EXPECT_EQ(ctl({"clock", "realtime"}).status, 0);
  EXPECT_EQ(ctl({"advance", "1s"}).status, 1) << "time goes by itself";
  Host host(own_bus());
  EXPECT_TRUE(host.query(1, kReadState2));
}

TEST_F(WithControl, CtlSendsDirectivesAndPrintsErrors) {
  StartedEmulator emulator(arguments("stepped", "1000000"));
  struct stat found {};
  ASSERT_EQ(::stat(socket().c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600U);
  EXPECT_EQ(ctl({"fault", "hang", "--ids", "1", "--for", "500ms"}).out,
            "at 0.000000 s\nfault hang\n");
  Host host(own_bus());
  host.send(0x141, kReadState2);
  EXPECT_EQ(ctl({"advance", "10ms"}).status, 0);
  EXPECT_FALSE(host.receive(0)) << "it hangs";
  EXPECT_NE(ctl({"faults"}).out.find("active"), std::string::npos);
  EXPECT_EQ(ctl({"clear", "hang"}).status, 0);
  host.send(0x141, kReadState2);
  EXPECT_EQ(ctl({"advance", "10ms"}).status, 0);
  EXPECT_TRUE(host.receive(0));
  const auto refused = ctl({"set", "ids=3", "supply_V=20"});
  EXPECT_EQ(refused.status, 1);
  EXPECT_EQ(refused.err, "lk-emu: ids: no drive 3 on this bus\n");
  EXPECT_EQ(ctl({"set", "supply_V=20", "--ids", "3"}).err, refused.err);
  EXPECT_EQ(ctl({"set", "supply_V=20", "--ids", "1-2"}).status, 0);
  EXPECT_EQ(ctl({"drive", "9"}).err, "lk-emu: ctl: no drive 9 on " + own_bus() + "\n");
  EXPECT_EQ(ctl({"set", "supply"}).status, 2);
  EXPECT_EQ(ctl({"power", "off", "--ids", "2"}).status, 0);
  EXPECT_EQ(ctl({"advance", "1s"}).status, 0);
  EXPECT_NE(ctl({"watch"}).out.find("no power"), std::string::npos) << "once, without a terminal";
  EXPECT_EQ(emulator.stop().status, 0);
  EXPECT_FALSE(std::filesystem::exists(socket()));
  EXPECT_EQ(ctl({"status"}).status, 2);
}

TEST_F(WithControl, CtlFindsTheOnlyProgram) {
  ::setenv("XDG_RUNTIME_DIR", directory_.c_str(), 1);
  std::vector<std::string> words = {"--rom", ":memory:", "--bus", own_bus(), "--ids", "1"};
  StartedEmulator first(words);
  EXPECT_EQ(EmulatorProcess({"ctl", "drives"}).wait().status, 0);
  struct stat found {};
  ASSERT_EQ(::stat((directory_ + "/lk-emu").c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0700U);
  words[3] = own_bus(1);
  StartedEmulator second(words);
  EXPECT_EQ(EmulatorProcess({"ctl", "drives"}).wait().status, 2) << "which one?";
  const auto of_second = EmulatorProcess({"ctl", "--bus", own_bus(1), "drives"}).wait();
  EXPECT_NE(of_second.out.find(own_bus(1)), std::string::npos);
  EXPECT_EQ(of_second.out.find(own_bus()), std::string::npos);
  EXPECT_EQ(second.stop().status, 0);
  EXPECT_EQ(first.stop(SIGINT).status, 0);
  EXPECT_EQ(EmulatorProcess({"ctl", "drives"}).wait().status, 2) << "nobody is there";
  ::unsetenv("XDG_RUNTIME_DIR");
}

}  // namespace clock_test
}  // namespace lk::host
