// A recording replays identically at full speed, also after a kill.

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <thread>

#include "tests/host/control_client.hpp"
#include "tests/host/emulator_process.hpp"
#include "tests/host/host.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::host {
namespace record_test {

namespace fs = std::filesystem;

/// A robot with two buses.
std::string robot() {
  return "seed = 5\n[[bus]]\ninterface = \"" + own_bus() + R"("
[[bus.drive]]
ids = "1-3"
motor = "mf7015"
[[bus.event]]
at_s = 0.2
id = 2
power = "cycle"
off_s = 0.05
[[bus.event]]
at_s = 0.3
id = 1
fault = { kind = "drop", probability = 0.2, for_s = 0.1 }
)" + "[[bus]]\nbitrate = 0\ninterface = \"" +
         own_bus(1) + R"("
[[bus.drive]]
id = 1
motor = "mg4005"
)";
}

/// Sends `windows` windows of frames as fast as possible. Waits after each until drive `last` has
/// answered.
void talk(const std::string& interface, int windows, int last) {
  Host host(interface);
  constexpr Payload kFrames[] = {
      {0x9A},       {0x9C}, {0xA2, 0, 0, 0, 0x10, 0x27, 0, 0},
      {0x90},       {0x92}, {0xA1, 0, 0, 0, 0x20, 0, 0, 0},
      {0x32, 0, 9}, {0x30}, {0xEE},
      {0x9D},       {0x81}, {0x88},
  };
  const canid_t asked = 0x140 + static_cast<canid_t>(last);
  for (int window = 0; window < windows; ++window) {
    for (std::size_t n = 0; n < std::size(kFrames); ++n) {
      Payload frame = kFrames[n];
      if (frame[0] == 0x32) frame[3] = static_cast<std::uint8_t>(window);
      if (frame[0] == 0x32 && window % 10 != 0) frame[0] = 0x31;
      host.send(0x141 + static_cast<canid_t>(n + static_cast<std::size_t>(window)) % 3, frame);
    }
    // A drive that writes its flash ignores frames: repeat the query.
    bool answered = false;
    for (int attempt = 0; attempt < 200 && !answered; ++attempt) {
      host.send(asked, {0x9C});
      while (const auto reply = answered ? std::nullopt : host.receive(100)) {
        // The other host's query has no temperature.
        answered = reply->can_id == asked && reply->data[0] == 0x9C && reply->data[1] != 0;
      }
    }
    ASSERT_TRUE(answered) << interface << ", window " << window;
  }
}

class Record : public testing::Test {
 protected:
  Record() { own_.put("robot.toml", robot()); }

  std::vector<std::string> arguments() const {
    return {"--config", scratch_ + "/robot.toml", "--rom", scratch_ + "/rom", "--record",
            directory()};
  }
  std::string directory() const { return scratch_ + "/recording"; }
  EmulatorProcess::Exit replay(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all = {"replay", directory()};
    all.insert(all.end(), more.begin(), more.end());
    return EmulatorProcess(all).wait();
  }

  const test::TempDirectory own_;
  const std::string scratch_ = own_.path().string();
};

/// Two hosts on one bus and one on the other at the same time: some 4000 frames.
void talk_on_both() {
  std::thread one([] { talk(own_bus(), 120, 3); });
  std::thread two([] { talk(own_bus(), 120, 3); });
  talk(own_bus(1), 60, 1);
  one.join();
  two.join();
}

TEST_F(Record, ReplaysIdentically) {
  {
    StartedEmulator emulator(arguments());
    talk_on_both();
    const auto result = emulator.stop();
    EXPECT_EQ(result.status, 0) << result.err;
  }
  const auto again =
      replay({"--candump", scratch_ + "/again.log", "--marks", "--csv", scratch_ + "/a.csv"});
  EXPECT_EQ(again.status, 0) << again.out << again.err;
  EXPECT_NE(again.out.find("replies, identical\n"), std::string::npos) << again.out;
  EXPECT_GT(std::stoi(again.out), 3500) << again.out;
  EXPECT_GT(fs::file_size(scratch_ + "/a.csv"), 1000U);
  EXPECT_EQ(fs::file_size(scratch_ + "/again.log"), fs::file_size(directory() + "/frames.log"));
  // The replay needs only the directory; the drives start from the recorded ROM.
  fs::remove(scratch_ + "/robot.toml");
  fs::remove_all(scratch_ + "/rom");
  EXPECT_EQ(replay().status, 0);
}

/// The second run starts from the ROM that the first one wrote.
TEST_F(Record, ReplaysFromTheRecordedRom) {
  {
    StartedEmulator emulator({"--config", scratch_ + "/robot.toml", "--rom", scratch_ + "/rom"});
    talk(own_bus(), 3, 3);
    EXPECT_EQ(emulator.stop().status, 0);
  }
  {
    StartedEmulator emulator(arguments());
    talk(own_bus(), 3, 3);
    EXPECT_EQ(emulator.stop().status, 0);
  }
  ASSERT_TRUE(fs::exists(directory() + "/rom/" + own_bus() + "-1.toml"));
  const auto again = replay();
  EXPECT_EQ(again.status, 0) << again.out << again.err;
}

TEST_F(Record, IsValidUpToItsLastLineAfterAKill) {
  {
    StartedEmulator emulator(arguments());
    talk_on_both();
    emulator.signal(SIGKILL);
    emulator.wait();
  }
  const auto again = replay();
  EXPECT_EQ(again.status, 0) << again.out << again.err;
  EXPECT_NE(again.out.find("identical up to "), std::string::npos) << again.out;
  EXPECT_GT(std::stoi(again.out), 3000) << again.out;
}

/// A recording that has ended on a blocked disk, and another one after it.
TEST_F(Record, BlockedDiskDelaysNothingElse) {
  const std::string fifo = scratch_ + "/disk";
  const std::string socket = scratch_ + "/s";
  ASSERT_TRUE(run("mkfifo " + fifo));
  StartedEmulator emulator(
      {"--bus", own_bus(), "--ids", "1", "--rom", ":memory:", "--control", socket},
      {"env", "LD_PRELOAD=" LKEMU_SLOW_DISK, "LKEMU_SLOW_DISK=" + fifo,
       "LKEMU_SLOW_FILE=" + scratch_ + "/1/frames.log"});
  const auto begin = [&](const std::string& name) {
    return ask(socket, "POST /recording", R"({"directory":")" + scratch_ + "/" + name + "\"}");
  };
  Host host(own_bus());
  ASSERT_EQ(begin("1").status, 200);
  ASSERT_TRUE(host.query(1, {0x9C}));
  ASSERT_TRUE(emulator.wait_for_log("writing"));
  ASSERT_EQ(ask(socket, "DELETE /recording").status, 200);
  auto second = std::async(std::launch::async, begin, "2");
  const bool answered =
      second.wait_for(std::chrono::milliseconds(kPatience_ms)) == std::future_status::ready;
  if (!answered) emulator.signal(SIGKILL);
  ASSERT_TRUE(answered);
  EXPECT_EQ(second.get().status, 200);
  EXPECT_TRUE(host.query(1, {0x9C}));
  ASSERT_EQ(ask(socket, "DELETE /recording").status, 200);
  const Answer third = begin("3");
  EXPECT_EQ(third.status, 409);
  EXPECT_NE(third.body.find("an earlier recording is still being written"), std::string::npos);
  EXPECT_FALSE(fs::exists(scratch_ + "/3"));
  EXPECT_TRUE(host.query(1, {0x9C}));
  std::ofstream(fifo) << std::string(100, '.');
  EXPECT_EQ(emulator.stop().status, 0);
  for (const char* ended : {"1", "2"}) {
    const std::string inputs = text_of(scratch_ + "/" + ended + "/directives.jsonl");
    EXPECT_NE(inputs.find("\"end\":true"), std::string::npos) << ended << inputs;
  }
}

TEST_F(Record, RequiresAnEmptyDirectory) {
  fs::create_directory(directory());
  std::ofstream(directory() + "/mine") << "precious";
  expect_refused(
      EmulatorProcess(arguments()),
      "lk-emu: " + directory() + " is not empty; a recording needs a directory of its own\n");
}

}  // namespace record_test
}  // namespace lk::host
