// Multi-drive commands on a bus with drives of several generations and series.

#include <gtest/gtest.h>

#include <numbers>

#include "emulator/core/generation.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace several_drives_test {

using namespace std::chrono_literals;
using test::drive;
using test::frame;
using test::Host;
using test::kMfLsb_A;
using test::kMgLsb_A;

/// v236 drives 1, 2, 3 and 6 and a legacy one, 4, all in multi-drive mode.
Host several() {
  std::initializer_list<ServoConfig> servos = {
      drive(Generation::kV236, Series::kMg, 1), drive(Generation::kV236, Series::kMf, 2),
      drive(Generation::kV236, Series::kMs, 3), drive(Generation::kLegacy, Series::kMf, 4),
      drive(Generation::kV236, Series::kMg, 6)};
  BusConfig config = test::bus_config({});
  config.servos = servos;
  for (auto& servo : config.servos) {
    servo.rom.broadcast_mode = true;
  }
  return Host(config);
}

std::vector<std::uint32_t> ids(const std::vector<protocol::Frame>& replies) {
  std::vector<std::uint32_t> result;
  for (const auto& reply : replies) {
    result.push_back(reply.id);
  }
  return result;
}

using Ids = std::vector<std::uint32_t>;

TEST(SeveralDrives, TorqueInTheScaleOfEach) {
  Host host = several();
  const auto replies = host.talk(frame("280#6400640064006400"));
  EXPECT_EQ(ids(replies), (Ids{0x141, 0x142, 0x144, 0x146}));  // MS has no torque command
  host.wait(1ms);
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 100 * kMgLsb_A, 1e-9);
  EXPECT_NEAR(host.bus.truth(2).i_q_ref, 100 * kMfLsb_A, 1e-9);
  EXPECT_NEAR(host.bus.truth(4).i_q_ref, 1.6, 1e-9);
  EXPECT_EQ(host.bus.truth(6).i_q_ref, 0);
}

TEST(SeveralDrives, Speed) {
  Host host = several();
  const auto replies = host.talk(frame("281#680198FE68016801"));  // 360, −360, 360, 360
  EXPECT_EQ(ids(replies), (Ids{0x141, 0x142, 0x143, 0x146}));     // not a legacy command
  for (const auto& reply : replies) {
    EXPECT_EQ(reply, [&] {
      auto expected = frame("141#A219000000000008");
      expected.id = reply.id;
      return expected;
    }());
  }
  host.wait(1s);
  const auto speed_dps = [&](int id) {
    return host.bus.truth(id).omega_m * 180 / std::numbers::pi;
  };
  EXPECT_NEAR(speed_dps(1), 360, 10);
  EXPECT_NEAR(speed_dps(2), -360, 10);
  EXPECT_NEAR(speed_dps(6), 0, 1);
}

TEST(SeveralDrives, Position) {
  Host host = several();
  const auto replies = host.talk(frame("282#1027 F0D8 1027 1027"));  // ±10000 = ±100°
  ASSERT_EQ(ids(replies), (Ids{0x141, 0x142, 0x143, 0x146}));
  EXPECT_EQ(replies[0].data[0], 0xA3);
  host.wait(2s);
  const auto moved_deg = [&](int id) {
    return (host.bus.truth(id).theta_m * 180 / std::numbers::pi) - 45;
  };
  EXPECT_NEAR(moved_deg(1), 55, 0.1);
  EXPECT_NEAR(moved_deg(2), -145, 0.1);
  EXPECT_NEAR(moved_deg(6), 0, 0.1);
}

TEST(SeveralDrives, AnyCommand) {
  Host host = several();
  const auto replies = host.talk(frame("288#9AFF9C0092009A00"));
  ASSERT_EQ(ids(replies), (Ids{0x141, 0x142, 0x143}));  // 4 is legacy, 6 has no slot
  EXPECT_EQ(replies[0], frame("141#9A19600900000000"));
  EXPECT_EQ(replies[1], frame("142#9C19000000000008"));
  EXPECT_EQ(replies[2], frame("143#9294110000000000"));
  // MS lacks torque, v236 lacks 0x30; the other slots are answered.
  EXPECT_EQ(ids(host.talk(frame("288#3000 8100 A100 9A00"))), (Ids{0x142}));
  EXPECT_EQ(host.bus.servo(1).stats.unknown_commands, 1U);
  EXPECT_EQ(host.bus.servo(3).stats.unknown_commands, 1U);
  EXPECT_EQ(host.bus.servo(6).stats.unknown_commands, 0U);
  EXPECT_EQ(host.run_state(2), RunState::kStopped);
  EXPECT_EQ(host.bus.stats().queries, 2U);
}

TEST(SeveralDrives, AnEmptySlotIsNoCommand) {
  Host host = several();
  EXPECT_EQ(ids(host.talk(frame("288#00FF9A0000000000"))), (Ids{0x142}));
  EXPECT_TRUE(host.talk(frame("288#0000000000000000")).empty());
  for (const int id : {1, 2, 3, 6}) {
    EXPECT_EQ(host.bus.servo(id).stats.unknown_commands, 0U) << id;
  }
  EXPECT_EQ(host.bus.stats().count(Drop::kUnknownCommand), 0U);
  EXPECT_EQ(host.bus.stats().count(Drop::kForeignId), 1U);
}

TEST(SeveralDrives, OnlyInMultiDriveMode) {
  Host host = Host(drive(Generation::kV236));
  for (const char* text : {"280#0000000000000000", "281#0000000000000000", "282#0000000000000000",
                           "288#9A00000000000000"}) {
    EXPECT_TRUE(host.talk(frame(text)).empty());
  }
  EXPECT_EQ(host.bus.stats().count(Drop::kWrongMode), 4U);
  // Drives outside the mode do not count unknown commands.
  EXPECT_TRUE(host.talk(frame("288#3000000000000000")).empty());
  EXPECT_EQ(host.bus.servo(1).stats.unknown_commands, 0U);
  EXPECT_EQ(host.bus.stats().count(Drop::kUnknownCommand), 0U);
  Host legacy = Host(drive(Generation::kLegacy));
  EXPECT_TRUE(legacy.talk(frame("281#0000000000000000")).empty());
  EXPECT_EQ(legacy.bus.stats().count(Drop::kForeignId), 1U);
}

}  // namespace several_drives_test
}  // namespace lk::emulator
