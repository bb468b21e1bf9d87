// 0xC0 and 0xC1: each parameter with its range and effect.

#include <gtest/gtest.h>

#include <cmath>

#include "emulator/core/generation.hpp"
#include "emulator/core/units.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace parameter_test {

using namespace std::chrono_literals;
using test::frame;
using test::Host;

ServoConfig drive(Series series = Series::kMg) {
  ServoConfig config = test::servo_config(1);
  config.quirks = quirks_of(Generation::kV236);
  config.profile.series = series;
  config.profile.drive.control.has_current_loop = series != Series::kMs;
  return config;
}

/// Returns the reply to 0xC0 after 0xC1, which echoes the query.
protocol::Frame written(Host& host, const char* write) {
  const auto query = frame(write);
  EXPECT_EQ(host.ask(query), query);
  protocol::Frame read = frame("141#C000000000000000");
  read.data[1] = query.data[1];
  return host.ask(read);
}

TEST(Parameters, AsTheyLeaveTheFactory) {
  auto config = drive();
  config.rom.current_ramp_A_s = 25;
  config.rom.acceleration_dps_s = 720;
  config.rom.max_angle_deg = 360;
  Host host(config);
  EXPECT_EQ(host.ask("141#C00AFFFFFFFFFFFF"), frame("141#C00A640064000000"));
  EXPECT_EQ(host.ask("141#C00B000000000000"), frame("141#C00B320028000000"));
  EXPECT_EQ(host.ask("141#C00C000000000000"), frame("141#C00C320032000000"));
  EXPECT_EQ(host.ask("141#C01E000000000000"), frame("141#C01E0000E8030000"));  // 1000
  EXPECT_EQ(host.ask("141#C020000000000000"), frame("141#C020000080A21900"));  // 16800.00 dps
  EXPECT_EQ(host.ask("141#C022000000000000"), frame("141#C0220000A08C0000"));  // 360.00°
  EXPECT_EQ(host.ask("141#C024000000000000"), frame("141#C0240000A8610000"));  // 25000 mA/s
  EXPECT_EQ(host.ask("141#C026000000000000"), frame("141#C0260000D0020000"));  // 720 dps/s
}

TEST(Parameters, UnknownOnesGetNoReply) {
  Host host(drive());
  EXPECT_TRUE(host.talk(frame("141#C00D000000000000")).empty());
  EXPECT_TRUE(host.talk(frame("141#C10D000000000000")).empty());
  EXPECT_EQ(host.bus.servo(1).stats.unknown_commands, 2U);
  EXPECT_EQ(host.bus.servo(1).stats.queries, 0U);
}

TEST(Parameters, WrittenToRamAndReadBack) {
  Host host(drive());
  EXPECT_EQ(written(host, "141#C10A0102030405FF"), frame("141#C00A0102030405FF"));
  EXPECT_EQ(written(host, "141#C10B640032000700"), frame("141#C00B640032000700"));
  EXPECT_EQ(written(host, "141#C10CFFFFFFFFFFFF"), frame("141#C00CFFFFFFFFFFFF"));
  EXPECT_EQ(written(host, "141#C11E55AAF4015555"), frame("141#C01E0000F4010000"));
  EXPECT_EQ(written(host, "141#C120 0000 A1860100"), frame("141#C0200000A1860100"));
  EXPECT_EQ(written(host, "141#C1220000A18C0000"), frame("141#C0220000A18C0000"));
  EXPECT_EQ(written(host, "141#C124000001000000"), frame("141#C024000001000000"));
  EXPECT_EQ(written(host, "141#C1260000FFFFFF7F"), frame("141#C0260000FFFFFF7F"));
  EXPECT_EQ(host.bus.stats().rom_writes, 0U);
  host.bus.power_cycle(1);
  EXPECT_EQ(host.bus.servo(1).ram, host.bus.servo(1).config.rom);
}

TEST(Parameters, AreClampedToTheirRange) {
  Host host(drive());
  EXPECT_EQ(written(host, "141#C11E0000FF7F0000"), frame("141#C01E000000080000"));  // 2048
  EXPECT_EQ(written(host, "141#C11E0000FFFF0000"), frame("141#C01E000000000000"));
  EXPECT_EQ(written(host, "141#C120000000000000"), frame("141#C020000064000000"));  // 1 dps
  EXPECT_EQ(written(host, "141#C1200000FFFFFF7F"), frame("141#C020000000DD6D00"));  // 72000 dps
  EXPECT_EQ(written(host, "141#C1220000FFFFFF7F"), frame("141#C022000000CA9A3B"));  // 1e7°
  EXPECT_EQ(written(host, "141#C1220000FFFFFFFF"), frame("141#C022000000000000"));
  EXPECT_EQ(written(host, "141#C124000000000080"), frame("141#C024000000000000"));
  EXPECT_EQ(written(host, "141#C126000000000080"), frame("141#C026000000000000"));
  EXPECT_EQ(written(host, "141#C1240000FFFFFF7F"), frame("141#C024000000CA9A3B"));  // 1e6 A/s
}

// All values of the 16-bit parameters and as many of the others: reads return the written value.
TEST(Parameters, EveryValueComesBack) {
  Host host(drive());
  protocol::Frame write = frame("141#C11E000000000000");
  protocol::Frame read = frame("141#C01E000000000000");
  for (int n = 0; n <= 2048; ++n) {
    protocol::put_le(write.data, 4, static_cast<std::int16_t>(n));
    host.ask(write);
    protocol::put_le(read.data, 4, static_cast<std::int16_t>(n));
    ASSERT_EQ(host.ask("141#C01E000000000000"), read);
  }
  for (const int id : {0x20, 0x22, 0x24, 0x26}) {
    for (std::int32_t n = 100; n < 7'000'000; n += 6997) {
      write.data = {0xC1, static_cast<std::uint8_t>(id)};
      protocol::put_le(write.data, 4, n);
      host.ask(write);
      read = write;
      read.data[0] = 0xC0;
      protocol::Frame query = frame("141#C000000000000000");
      query.data[1] = static_cast<std::uint8_t>(id);
      ASSERT_EQ(host.ask(query), read);
    }
  }
}

TEST(Parameters, MaxTorqueCurrentLimitsTheLoops) {
  Host host(drive());
  host.ask("141#C11E000064000000");  // 100
  host.ask("141#A200000040420F00");
  double most_A = 0;
  for (int k = 0; k < 40; ++k) {
    host.wait(250us);
    most_A = std::max(most_A, std::abs(host.bus.truth(1).i_q_ref));
  }
  EXPECT_NEAR(most_A, 100 * 66.0 / 4096, 1e-9);
}

/// Returns the largest demand of the loops within 10 ms of 0xA2.
double most_A(Host& host, const char* speed) {
  host.ask(speed);
  double most = 0;
  for (int k = 0; k < 40; ++k) {
    host.wait(250us);
    most = std::max(most, std::abs(host.bus.truth(1).i_q_ref));
  }
  return most;
}

double speed_dps(const Host& host) { return dps_from_rad_s(host.bus.truth(1).omega_m); }

TEST(Parameters, MaxSpeedBindsACommandInForce) {
  Host host(drive());
  host.ask("141#A2000000A0860100");  // 1000 dps
  host.wait(500ms);
  EXPECT_NEAR(speed_dps(host), 1000, 10);
  host.ask("141#C1200000A08C0000");  // 360 dps
  host.wait(500ms);
  EXPECT_NEAR(speed_dps(host), 360, 10);
  host.ask("141#C1200000E0930400");  // 3000 dps: the commanded speed is possible again
  host.wait(500ms);
  EXPECT_NEAR(speed_dps(host), 1000, 10);
  host.ask("141#8100000000000000");
  host.ask("141#C1200000A08C0000");  // no motion while stopped
  host.wait(2ms);
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0);
  auto config = drive();
  config.quirks.dialect.speed_iq_limit = false;  // Max Speed does not limit 0xA2 there
  Host other(config);
  other.ask("141#A2000000A0860100");
  other.ask("141#C1200000A08C0000");
  other.wait(500ms);
  EXPECT_NEAR(speed_dps(other), 1000, 10);
}

TEST(Parameters, MaxSpeedBindsAPositionInForce) {
  Host host(drive());
  host.ask("141#C1200000A08C0000");  // 360 dps
  host.ask("141#A400E80340420F00");  // to 10000° with 1000 dps
  host.wait(500ms);
  EXPECT_NEAR(speed_dps(host), 360, 10);
  host.ask("141#C1200000E0930400");  // 3000 dps
  host.wait(500ms);
  EXPECT_NEAR(speed_dps(host), 1000, 10);
  host.ask("141#C1200000A08C0000");
  host.wait(500ms);
  EXPECT_NEAR(speed_dps(host), 360, 10);
}

TEST(Parameters, MaxAngleBindsAPositionInForce) {
  Host host(drive());
  host.ask("141#A300000020BF0200");  // 1800°
  host.ask("141#C1220000A08C0000");  // 360°
  host.wait(1s);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 36000, 4);
  host.ask("141#C122000000000000");  // no limit
  host.wait(1s);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 180000, 4);
  host.ask("141#9500000010270000");  // renames the present angle to 100°; the shaft stays
  host.ask("141#C122000088130000");  // 50°
  host.wait(1s);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 10000, 4);
  host.ask("141#A300000010270000");  // a new command uses the new angles
  host.wait(1s);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 5000, 4);
}

TEST(Parameters, MaxPowerLimitsTheLoopsOfMs) {
  const auto most_power = [](const char* limit) {
    Host host(drive(Series::kMs));
    host.ask(limit);
    host.ask("141#A200000040420F00");  // 10000 dps
    double most = 0;
    for (int k = 0; k < 400; ++k) {
      host.wait(250us);
      most = std::max(most, std::abs(host.bus.telemetry(1).power));
    }
    return most;
  };
  EXPECT_NEAR(most_power("141#C11E0000C8000000"), 0.2, 0.005);  // 200
  EXPECT_NEAR(most_power("141#C11E0000F4010000"), 0.5, 0.005);  // 500
}

// Power is the only limit of MS, in every generation.
TEST(Parameters, NoCurrentLimitsTheLoopsOfMs) {
  for (const Generation generation : {Generation::kLegacy, Generation::kV236}) {
    auto config = drive(Series::kMs);
    config.quirks = quirks_of(generation);
    config.rom.max_torque_current_lsb = 1;
    Host host(config);
    EXPECT_GT(most_A(host, "141#A200000040420F00"), 10);
  }
}

TEST(Parameters, MsHaveMaxPowerInstead) {
  Host host(drive(Series::kMs));
  EXPECT_EQ(host.ask("141#C01E000000000000"), frame("141#C01E000052030000"));  // 850
  EXPECT_EQ(written(host, "141#C11E0000FF7F0000"), frame("141#C01E000052030000"));
  EXPECT_EQ(written(host, "141#C11E000064000000"), frame("141#C01E000064000000"));
  EXPECT_EQ(host.bus.servo(1).ram.max_torque_current_lsb, 1000);
}

TEST(Parameters, ByteCommandsLeaveKdAlone) {
  auto config = drive();
  config.quirks.dialect.pid_commands = true;  // a combination of switches
  Host host(config);
  host.ask("141#C10A0102030405FF");
  EXPECT_EQ(host.ask("141#3000000000000000"), frame("141#3000FFFF32283232"));  // at most 255
  host.ask("141#3100010203040506");
  EXPECT_EQ(host.ask("141#C00A000000000000"), frame("141#C00A0100020005FF"));
}

TEST(Parameters, ByteCommandsWriteNoKdToRom) {
  auto config = drive();
  config.quirks.dialect.pid_commands = true;
  config.rom.gains.angle_kd = 7;
  Host host(config);
  host.ask("141#C10A0102030405FF");  // RAM
  host.ask("141#3200010203040506");
  EXPECT_EQ(host.bus.servo(1).ram.gains.angle_kd, 0xFF05);
  EXPECT_EQ(host.bus.servo(1).rom.gains.angle_kd, 7);
  EXPECT_EQ(host.bus.servo(1).rom.gains.current_ki, 6);
}

}  // namespace parameter_test
}  // namespace lk::emulator
