#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <mutex>
#include <semaphore>

#include "emulator/files/rom_store.hpp"
#include "emulator/io/live/line.hpp"
#include "protocol/commands.hpp"
#include "tests/emulator/rom/rom_support.hpp"
#include "tests/support/log.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace rom_gate_test {

using protocol::Frame;

/// Returns a reply that `mark` identifies.
TimedFrame reply(int id, std::uint8_t mark, std::uint64_t after = 0) {
  TimedFrame out;
  out.frame.id = 0x140 + static_cast<std::uint32_t>(id);
  out.frame.data[0] = mark;
  out.after_rom_write = after;
  return out;
}

struct Gate {
  RomGate gate{test::bus_config({1, 2, 32})};
  std::vector<Frame> out;

  void pass(const TimedFrame& frame) { gate.pass(frame, out); }
  const RomGate::Kept* settle(int id, std::uint64_t number, bool durable = true) {
    return gate.settle(rom_write(id, number), durable, out);
  }
  /// Returns the marks of the replies released since the last call.
  std::vector<int> left() {
    std::vector<int> marks;
    for (const Frame& frame : out) marks.push_back(frame.data[0]);
    out.clear();
    return marks;
  }
};

using Marks = std::vector<int>;

TEST(RomGate, HoldsWrongIdentifiersButNotErrorFrames) {
  Gate g;
  g.gate.begin(rom_write(1, 1));
  TimedFrame wrong = reply(2, 1, 1);
  wrong.drive_id = 1;
  g.pass(wrong);
  g.pass(reply(1, 2));
  TimedFrame echo = reply(7, 9);  // a host's own frame, to an absent drive
  echo.echo = true;
  g.pass(echo);
  EXPECT_EQ(g.left(), Marks{9});
  TimedFrame error = reply(40, 3);  // low bits of an absent drive
  error.frame.kind = protocol::FrameKind::kError;
  g.pass(error);
  TimedFrame babble = reply(0, 4);  // identifier 0x140
  babble.drive_id = 2;
  g.pass(babble);
  EXPECT_EQ(g.left(), (Marks{3, 4}));
  g.settle(1, 1);
  EXPECT_EQ(g.left(), (Marks{1, 2}));
}

TEST(RomGate, HoldsRepliesOfTheWritingDriveOnly) {
  Gate g;
  g.gate.begin(rom_write(1, 1));
  g.pass(reply(1, 1));
  g.pass(reply(1, 2, 1));
  g.pass(reply(2, 3));
  g.pass(reply(1, 4));
  g.pass(reply(32, 5));
  EXPECT_EQ(g.left(), (Marks{1, 3, 5}));
  EXPECT_FALSE(g.gate.idle());
  EXPECT_EQ(g.settle(1, 1), nullptr);
  EXPECT_EQ(g.left(), (Marks{2, 4}));
  EXPECT_TRUE(g.gate.idle());
}

TEST(RomGate, HoldsNothingAfterTheWriteIsDone) {
  Gate g;
  g.gate.begin(rom_write(1, 1));
  g.settle(1, 1);
  g.pass(reply(1, 1, 1));
  EXPECT_EQ(g.left(), Marks{1});
}

TEST(RomGate, EachReplyWaitsForItsOwnWrite) {
  Gate g;
  for (std::uint64_t n = 1; n <= 4; ++n) {
    g.gate.begin(rom_write(1, n));
    g.pass(reply(1, static_cast<std::uint8_t>(n), n));
  }
  g.settle(1, 1);
  EXPECT_EQ(g.left(), Marks{1});
  g.settle(1, 3);  // two writes merged into one
  EXPECT_EQ(g.left(), (Marks{2, 3}));
  EXPECT_FALSE(g.gate.idle());
  g.settle(1, 4);
  EXPECT_EQ(g.left(), Marks{4});
}

TEST(RomGate, DropsOnlyTheReplyOfAFailedWrite) {
  Gate g;
  g.gate.begin(rom_write(1, 1));
  g.pass(reply(1, 1, 1));
  g.pass(reply(1, 2));
  const auto* kept = g.settle(1, 1, false);
  ASSERT_NE(kept, nullptr);
  EXPECT_EQ(kept->wear, RomWear{}) << "what it booted with";
  EXPECT_EQ(g.left(), Marks{2});
  EXPECT_EQ(g.gate.failed_writes(), 1U);
  EXPECT_EQ(g.gate.lost_replies(), 1U);

  g.gate.begin(rom_write(1, 2));
  g.pass(reply(1, 3, 2));
  EXPECT_EQ(g.settle(1, 2), nullptr);
  EXPECT_EQ(g.left(), Marks{3});
  g.gate.begin(rom_write(1, 3));
  kept = g.settle(1, 3, false);
  ASSERT_NE(kept, nullptr);
  EXPECT_EQ(kept->rom.encoder_offset, 2) << "the last that is durable";
}

TEST(RomGate, DropsALateReplyOfAFailedWrite) {
  Gate g;
  g.gate.begin(rom_write(1, 1));
  g.gate.begin(rom_write(1, 2));
  g.settle(1, 1, false);
  g.settle(1, 2);
  g.pass(reply(1, 1, 1));
  g.pass(reply(1, 2, 2));
  EXPECT_EQ(g.left(), Marks{2});
}

TEST(RomGate, DropsOnlyRepliesOfTheFailedWrites) {
  Gate g;
  for (std::uint64_t n = 1; n <= 6; ++n) g.gate.begin(rom_write(1, n));
  for (std::uint64_t n = 1; n <= 6; ++n) g.settle(1, n, n == 1 || n == 4);
  for (int n = 1; n <= 6; ++n)
    g.pass(reply(1, static_cast<std::uint8_t>(n), static_cast<std::uint64_t>(n)));
  EXPECT_EQ(g.left(), (Marks{1, 4}));
  EXPECT_EQ(g.gate.lost_replies(), 4U);
}

TEST(RomGate, PendingWriteIncludesTheFailedOne) {
  Gate g;
  g.gate.begin(rom_write(1, 1));
  g.gate.begin(rom_write(1, 2));
  EXPECT_EQ(g.settle(1, 1, false), nullptr) << "ROM goes back only when nothing is to come";
  EXPECT_EQ(g.settle(1, 2), nullptr);
}

TEST(RomGate, LimitsHeldReplies) {
  Gate g;
  g.gate.begin(rom_write(1, 1));
  g.pass(reply(1, 1, 1));
  for (std::size_t i = 0; i < RomGate::kMaxHeld + 9; ++i) g.pass(reply(1, 2));
  g.pass(reply(2, 3));
  EXPECT_EQ(g.left(), Marks{3});
  EXPECT_EQ(g.gate.lost_replies(), 10U);
  g.settle(1, 1);
  EXPECT_EQ(g.left().size(), RomGate::kMaxHeld);
}

// --- from bus to disk and back

/// A bus, its gate, and a disk that blocks until released.
class BlockedDisk : public testing::Test {
 protected:
  static BusConfig config() {
    BusConfig config = test::bus_config({1, 2, 3});
    for (ServoConfig& servo : config.servos) servo.flash.write_time = SimTime{0};
    return config;
  }

  std::vector<Frame> talk(int id, const protocol::Command& command) {
    bus_.receive({bus_.time(), protocol::encode_query(id, command, protocol::kLegacyFormat)});
    return advance();
  }

  /// Returns the frames that leave for the bus within a millisecond, including completed writes.
  std::vector<Frame> advance() {
    std::vector<Frame> out;
    const auto take = [&] {
      std::vector<RomWrite> writes;
      bus_.take_rom_writes(writes);
      for (const RomWrite& write : writes) {
        gate_.begin(write);
        writer_.write(places_.at(static_cast<std::size_t>(write.id) - 1), write);
      }
      std::vector<TimedFrame> replies;
      bus_.take_replies(replies);
      for (const TimedFrame& reply : replies) gate_.pass(reply, out);
    };
    bus_.advance_to(bus_.time() + std::chrono::milliseconds(1));
    take();
    return out;
  }

  /// Lets the disk finish one write and processes its answer, as the loop does.
  std::vector<Frame> finish_one(int error) {
    std::vector<Frame> out;
    error_ = error;
    unblocked_.release();
    written_.acquire();
    const std::lock_guard lock(mutex_);
    if (const auto* kept = gate_.settle(done_.back(), error == 0, out)) {
      bus_.restore_rom(done_.back().id, kept->rom, kept->wear);
    }
    return out;
  }

  Bus bus_{config()};
  RomGate gate_{config()};
  std::vector<RomFile> places_ = {{-1, "1", 0, {"test", 1, "test"}},
                                  {-1, "2", 0, {"test", 2, "test"}},
                                  {-1, "3", 0, {"test", 3, "test"}}};
  std::counting_semaphore<> unblocked_{0};
  std::counting_semaphore<> written_{0};
  std::atomic<int> error_ = 0;
  std::mutex mutex_;
  std::vector<RomWrite> done_;
  RomWriter writer_{[this](const RomFile&, const RomWrite& write, int) {
                      const std::lock_guard lock(mutex_);
                      done_.push_back(write);
                      written_.release();
                    },
                    [this](int, const std::string&, const std::string&) {
                      unblocked_.acquire();
                      return error_.load();
                    }};
};

constexpr protocol::PidGains kNewGains = {11, 22, 33, 44, 55, 66};

TEST_F(BlockedDisk, DelaysOnlyTheWritingDrive) {
  EXPECT_TRUE(talk(1, protocol::WritePidToRom{kNewGains}).empty()) << "not durable yet";
  for (int i = 0; i < 100; ++i) {
    for (const int id : {2, 3}) {
      const auto replies = talk(id, protocol::ReadState2{});
      ASSERT_EQ(replies.size(), 1U) << "the disk is drive 1's affair";
      EXPECT_EQ(replies[0].id, 0x140U + static_cast<unsigned>(id));
    }
  }
  EXPECT_TRUE(talk(1, protocol::ReadPid{}).empty()) << "in order, behind the acknowledgement";
  const auto replies = finish_one(0);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0].data[0], 0x32);
  EXPECT_EQ(replies[1].data[0], 0x30);
  EXPECT_EQ(replies[1].data[2], 11);
  EXPECT_EQ(talk(1, protocol::ReadPid{}).size(), 1U);
}

TEST_F(BlockedDisk, FullDiskRevertsRomButNotRam) {
  const Registers before = bus_.servo(1).rom;
  EXPECT_TRUE(talk(1, protocol::WritePidToRom{kNewGains}).empty());
  EXPECT_NE(bus_.servo(1).rom, before);
  EXPECT_TRUE(finish_one(ENOSPC).empty()) << "what is not done is not acknowledged";
  EXPECT_EQ(bus_.servo(1).rom, before);
  EXPECT_EQ(bus_.servo(1).wear, RomWear{});
  EXPECT_EQ(bus_.servo(1).ram.gains.angle_kp, 11);
  EXPECT_EQ(talk(1, protocol::ReadPid{}).size(), 1U);
}

// --- a later write in the flash while the disk refuses an earlier one

/// A drive whose flash takes 20 ms, between its bus and a gate; the test acts as the disk.
class WriteAfterFailure : public testing::Test {
 protected:
  static constexpr SimTime kFlash = std::chrono::milliseconds(20);

  WriteAfterFailure() {
    send(protocol::WritePidToRom{{1, 1, 1, 1, 1, 1}});
    wait(kFlash);
    settle(true);
    send(protocol::WriteOffsetToRom{111});  // the write that fails
    wait(kFlash);
    send(protocol::WritePidToRom{{2, 2, 2, 2, 2, 2}});
    wait(kFlash / 2);
  }

  static BusConfig config() {
    BusConfig config = test::bus_config({1});
    config.servos[0].flash.write_time = kFlash;
    config.servos[0].profile.drive.logic.boot_time = 0.001;
    return config;
  }
  void send(const protocol::Command& command) {
    bus_.receive({bus_.time(), protocol::encode_query(1, command, protocol::kLegacyFormat)});
  }
  void wait(SimTime time) {
    bus_.advance_to(bus_.time() + time);
    const std::size_t known = writes_.size();
    bus_.take_rom_writes(writes_);
    for (std::size_t k = known; k < writes_.size(); ++k) gate_.begin(writes_[k]);
    std::vector<TimedFrame> replies;
    bus_.take_replies(replies);
    for (const TimedFrame& reply : replies) gate_.pass(reply, sent_);
  }
  void settle(bool durable) {
    ASSERT_LT(settled_, writes_.size());
    const RomWrite& write = writes_[settled_++];
    if (const auto* kept = gate_.settle(write, durable, sent_)) {
      bus_.restore_rom(1, kept->rom, kept->wear);
    }
  }
  void cut_power() {
    bus_.apply({1, SupplyVoltage{0.0, SimTime{0}}});
    wait(std::chrono::milliseconds(9));
    bus_.apply({1, SupplyVoltage{24.0, SimTime{0}}});
    wait(std::chrono::milliseconds(100));
  }
  void expect_rom(std::uint16_t gain, std::uint16_t offset) const {
    EXPECT_EQ(bus_.servo(1).rom.gains.angle_kp, gain);
    EXPECT_EQ(bus_.servo(1).rom.encoder_offset, offset);
  }

  Bus bus_{config()};
  RomGate gate_{config()};
  std::vector<RomWrite> writes_;
  std::size_t settled_ = 0;
  std::vector<Frame> sent_;
};

TEST_F(WriteAfterFailure, IncludesTheFailedOneAndIsKept) {
  settle(false);
  wait(kFlash);
  settle(true);
  ASSERT_FALSE(sent_.empty());
  EXPECT_EQ(sent_.back().data[0], 0x32) << "acknowledged";
  expect_rom(2, 111);
  send(protocol::WriteZeroToRom{});
  wait(kFlash);
  EXPECT_EQ(writes_.back().rom.gains.angle_kp, 2) << "an acknowledged write is not overwritten";
  EXPECT_EQ(writes_.back().wear[0], 2U);
}

TEST_F(WriteAfterFailure, PowerCutKeepsDurableValues) {
  settle(false);
  cut_power();
  expect_rom(1, 0);
  EXPECT_EQ(writes_.size(), 2U);
}

TEST_F(WriteAfterFailure, PowerCutBeforeTheFailureKeepsDurableValues) {
  cut_power();
  expect_rom(1, 111);
  settle(false);
  expect_rom(1, 0);
}

TEST_F(WriteAfterFailure, IsKeptBeforeItIsCollected) {
  bus_.advance_to(bus_.time() + kFlash);
  settle(false);
  wait(SimTime{1});
  settle(true);
  expect_rom(2, 111);
}

// --- messages

TEST(RefusedRom, IsLoggedOncePerDriveUntilTheNextSuccess) {
  const test::Log log;
  BusConfig bus = test::bus_config({1, 2});
  bus.interface = "vcan0";
  Line line(bus);
  for (std::uint64_t n = 1; n <= 500; ++n) {
    line.settle_rom(rom_write(1, n), ENOSPC);
    line.settle_rom(rom_write(2, n), n < 3 ? EACCES : 0);
  }
  line.settle_rom(rom_write(1, 501), 0);
  line.settle_rom(rom_write(1, 502), EIO);
  EXPECT_EQ(line.gate().failed_writes(), 503U) << "all are counted";
  EXPECT_EQ(log.text(),
            "vcan0:1: ROM not written: No space left on device; the drive continues with RAM\n"
            "vcan0:2: ROM not written: Permission denied; the drive continues with RAM\n"
            "vcan0:2: ROM is written again; 2 writes were refused\n"
            "vcan0:1: ROM is written again; 500 writes were refused\n"
            "vcan0:1: ROM not written: Input/output error; the drive continues with RAM\n");
}

}  // namespace rom_gate_test
}  // namespace lk::emulator
