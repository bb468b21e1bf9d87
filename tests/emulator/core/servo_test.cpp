// Replies of a drive, byte by byte: every command, registers, angles, states. Other files cover run
// state and motion commands.

#include "emulator/core/servo/servo.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace servo_test {

using namespace std::chrono_literals;
using test::frame;
using test::Host;
using test::servo_config;

// --- every query gets its reply

/// Sends each command once, with garbage in the unused bytes.
void ask_everything(Host& host) {
  for (const auto& row : protocol::commands()) {
    if (!protocol::knows(protocol::kLegacyFormat, row)) {
      continue;
    }
    protocol::Frame query = frame("141#00 00 34 12 78 56 00 00");
    query.data[0] = static_cast<std::uint8_t>(row.opcode);
    const auto replies = host.talk(query);
    ASSERT_EQ(replies.size(), 1U) << row.name;
    EXPECT_EQ(replies[0].id, 0x141U) << row.name;
    EXPECT_EQ(replies[0].dlc, 8) << row.name;
    EXPECT_EQ(replies[0].data[0], query.data[0]) << row.name;
  }
}

TEST(Servo, AnswersEveryCommandInEveryState) {
  Host host(servo_config(1));
  ask_everything(host);
  host.ask("141#8000000000000000");
  ask_everything(host);
  host.ask("141#8800000000000000");
  host.ask("141#8100000000000000");
  ask_everything(host);
  const auto stats = host.bus.servo(1).stats;
  EXPECT_EQ(stats.queries, 3U * 28 + 3);
  EXPECT_EQ(stats.replies, stats.queries);
}

TEST(Servo, NeverSpeaksUnasked) {
  Host host(servo_config(1));
  host.wait(1s);
  std::vector<TimedFrame> replies;
  host.bus.take_replies(replies);
  EXPECT_TRUE(replies.empty());
}

TEST(Servo, UnknownCommandsGetNoReply) {
  Host host(servo_config(1));
  int silent = 0;
  for (unsigned byte = 0; byte < 256; ++byte) {
    protocol::Frame query = frame("141#0000000000000000");
    query.data[0] = static_cast<std::uint8_t>(byte);
    silent += host.talk(query).empty() ? 1 : 0;
  }
  EXPECT_EQ(silent, 256 - 28);
  EXPECT_EQ(host.bus.servo(1).stats.unknown_commands, 228U);
  EXPECT_EQ(host.bus.stats().count(Drop::kUnknownCommand), 228U);
}

TEST(Servo, EchoesRepeatTheRequestAsReceived) {
  Host host(servo_config(1));
  for (const char* text : {"141#31DE646432280A0B", "141#32DE646432280A0B", "141#34ADBEEF10270000",
                           "141#91010203 0405 6400", "141#95FFFFFFFFFFFFFF", "141#80DEADBEEFDEADBE",
                           "141#88DEADBEEFDEADBE", "141#81DEADBEEFDEADBE"}) {
    EXPECT_EQ(host.ask(text), frame(text));
  }
}

// --- registers

TEST(Registers, FactoryGains) {
  Host host(servo_config(1));
  EXPECT_EQ(host.ask("141#3000000000000000"), frame("141#3000 6464 3228 3232"));
}

TEST(Registers, GainsInRamAreLostAtPowerOff) {
  Host host(servo_config(1));
  host.ask("141#3100010203040506");
  EXPECT_EQ(host.ask("141#3000000000000000"), frame("141#3000010203040506"));
  host.bus.power_cycle(1);
  EXPECT_EQ(host.ask("141#3000000000000000"), frame("141#3000646432283232"));
  EXPECT_EQ(host.bus.stats().rom_writes, 0U);
}

TEST(Registers, GainsInRomSurvivePowerOff) {
  Host host(servo_config(1));
  host.ask("141#3200010203040506");
  EXPECT_EQ(host.ask("141#3000000000000000"), frame("141#3000010203040506"));
  host.bus.power_cycle(1);
  EXPECT_EQ(host.ask("141#3000000000000000"), frame("141#3000010203040506"));
  EXPECT_EQ(host.bus.stats().rom_writes, 1U);
}

TEST(Registers, AccelerationIsRam) {
  auto config = servo_config(1);
  config.rom.acceleration_dps_s = 720;
  Host host(config);
  EXPECT_EQ(host.ask("141#3300000000000000"), frame("141#33000000D0020000"));
  host.ask("141#3400000010270000");
  EXPECT_EQ(host.ask("141#3300000000000000"), frame("141#3300000010270000"));
  host.bus.power_cycle(1);
  EXPECT_EQ(host.ask("141#3300000000000000"), frame("141#33000000D0020000"));
}

TEST(Registers, NegativeAccelerationIsClampedToNone) {
  Host host(servo_config(1));
  host.ask("141#34000000FFFFFFFF");
  EXPECT_EQ(host.ask("141#3300000000000000"), frame("141#3300000000000000"));
}

// --- angles

TEST(Angles, AtPowerUp) {
  Host host(servo_config(1));  // 45° = 2048 = 0x0800 counts = 4500 = 0x1194
  EXPECT_EQ(host.ask("141#9000000000000000"), frame("141#9000 0008 0008 0000"));
  EXPECT_EQ(host.ask("141#9200000000000000"), frame("141#92 94110000000000"));
  EXPECT_EQ(host.ask("141#9400000000000000"), frame("141#94 0000000000 9411"));
}

TEST(Angles, MultiTurnStartsWrapped) {
  auto config = servo_config(1);
  config.boot_angle_deg = 225;
  EXPECT_EQ(Host(config).multi_turn_cdeg(), -13500);
  EXPECT_EQ(Host(config).single_turn_cdeg(), 22500);
  config.boot_angle_deg = 180;  // the closed end of the interval
  EXPECT_EQ(Host(config).multi_turn_cdeg(), 18000);
  config.boot_angle_deg = 180.03;
  EXPECT_EQ(Host(config).multi_turn_cdeg(), -17998);  // 8193 counts − one turn = −8191 counts
}

TEST(Angles, CountFromTheStoredOffset) {
  auto config = servo_config(1);
  config.rom.encoder_offset = 1000;  // encoder = raw − offset: 2048 = 3048 − 1000
  Host host(config);
  EXPECT_EQ(host.ask("141#9000000000000000"), frame("141#9000 0008 E80B E803"));
  EXPECT_EQ(host.multi_turn_cdeg(), 4500);
}

TEST(Angles, OffsetWriteIsInForceAtOnce) {
  Host host(servo_config(1));
  host.ask("141#910000000000 0004");  // 1024
  EXPECT_EQ(host.ask("141#9000000000000000"), frame("141#9000 0004 0008 0004"));
  EXPECT_EQ(host.single_turn_cdeg(), 2250);
  EXPECT_EQ(host.multi_turn_cdeg(), 4500);  // the turn counter is unchanged until power-up
  host.bus.power_cycle(1);
  EXPECT_EQ(host.multi_turn_cdeg(), 2250);
}

TEST(Angles, OffsetWriteCanWaitForPowerUp) {
  auto config = servo_config(1);
  config.quirks.offset_write_takes_effect = false;
  Host host(config);
  host.ask("141#910000000000 0004");
  EXPECT_EQ(host.ask("141#9000000000000000"), frame("141#9000 0008 0008 0000"));
  EXPECT_EQ(host.single_turn_cdeg(), 4500);
  host.bus.power_cycle(1);
  EXPECT_EQ(host.ask("141#9000000000000000"), frame("141#9000 0004 0008 0004"));
}

TEST(Angles, OffsetIsClampedToTheEncoder) {
  Host host(servo_config(1));
  EXPECT_EQ(host.ask("141#910000000000FFFF"), frame("141#910000000000FFFF"));
  EXPECT_EQ(host.bus.servo(1).ram.encoder_offset, 16383);
}

TEST(Angles, PresentPositionBecomesZeroAfterPowerUp) {
  Host host(servo_config(1));
  EXPECT_EQ(host.ask("141#1900000000000000"), frame("141#19 0000000000 0008"));
  EXPECT_EQ(host.ask("141#9000000000000000"), frame("141#9000 0008 0008 0000"));
  EXPECT_EQ(host.multi_turn_cdeg(), 4500);
  host.bus.power_cycle(1);
  EXPECT_EQ(host.ask("141#9000000000000000"), frame("141#9000 0000 0008 0008"));
  EXPECT_EQ(host.multi_turn_cdeg(), 0);
  EXPECT_EQ(host.single_turn_cdeg(), 0);
  EXPECT_EQ(host.bus.stats().rom_writes, 1U);
}

TEST(Angles, ClearAngleDoesNothing) {
  Host host(servo_config(1));
  host.ask("141#9500000000000000");
  EXPECT_EQ(host.multi_turn_cdeg(), 4500);
  EXPECT_EQ(host.single_turn_cdeg(), 4500);
}

TEST(Angles, ClearAngleImplemented) {
  auto config = servo_config(1);
  config.quirks.dialect.clear_angle = protocol::ClearAngleMeaning::kImplemented;
  Host host(config);
  host.ask("141#9500000000000000");
  EXPECT_EQ(host.multi_turn_cdeg(), 0);
  EXPECT_EQ(host.single_turn_cdeg(), 0);
  host.bus.power_cycle(1);  // valid until power-off
  EXPECT_EQ(host.multi_turn_cdeg(), 4500);
  EXPECT_EQ(host.single_turn_cdeg(), 4500);
}

TEST(Angles, BootAngleIsDrawnAndNeverZero) {
  std::set<std::int64_t> angles_cdeg;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    BusConfig config = test::bus_config({1, 2, 31, 32});
    config.seed = seed;
    for (auto& servo : config.servos) {
      servo.boot_angle_deg.reset();
    }
    Host host(config);
    for (const int id : {1, 2, 31, 32}) {
      const auto angle_cdeg = host.multi_turn_cdeg(id);
      EXPECT_NE(angle_cdeg, 0);
      EXPECT_GE(host.single_turn_cdeg(id), 499);
      EXPECT_LE(host.single_turn_cdeg(id), 35500);
      angles_cdeg.insert(angle_cdeg);
    }
  }
  EXPECT_GT(angles_cdeg.size(), 75U);  // of 80: differ for most seeds and IDs
}

// --- state replies

TEST(States, AtRest) {
  Host host(servo_config(1));
  host.wait(10ms);
  EXPECT_EQ(host.ask("141#9A00000000000000"), frame("141#9A 19 00 F000 0000 00"));  // 25 °C, 24.0 V
  EXPECT_EQ(host.ask("141#9B00000000000000"), frame("141#9B 19 00 F000 0000 00"));
  EXPECT_EQ(host.ask("141#9C00000000000000"), frame("141#9C 19 0000 0000 0008"));
  EXPECT_EQ(host.ask("141#9D00000000000000"), frame("141#9D 19 0000 0000 0000"));
}

TEST(States, PhaseCurrentsSumToZero) {
  Host host(servo_config(1));
  host.ask("141#A100000064000000");
  host.wait(5ms);
  const auto state = host.get<protocol::State3>(protocol::ReadState3{});
  EXPECT_NEAR(state.i_a_A + state.i_b_A + state.i_c_A, 0, 2.0 / 64);
  EXPECT_GT(std::abs(state.i_a_A) + std::abs(state.i_b_A) + std::abs(state.i_c_A), 1.6);
}

}  // namespace servo_test
}  // namespace lk::emulator
