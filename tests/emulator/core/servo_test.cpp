// Replies of a drive, byte by byte: every command, registers, angles, states, parameters (0xC0 and
// 0xC1). Other files cover run state and motion commands.

#include "emulator/core/servo/servo.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "emulator/core/generation.hpp"
#include "tests/emulator/core/core_support.hpp"

namespace lk::emulator {
namespace servo_test {

using namespace std::chrono_literals;
using test::frame;
using test::Host;
using test::most_A;
using test::send;
using test::servo_config;
using test::speed_dps;

/// Sends each command once, with garbage in the unused bytes.
void expect_all_answered(Host& host) {
  for (const auto& row : protocol::commands()) {
    if (!protocol::knows(protocol::kLegacyFormat, row)) continue;
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
  expect_all_answered(host);
  host.ask("141#8000000000000000");
  expect_all_answered(host);
  send(host, {"141#8800000000000000", "141#8100000000000000"});
  expect_all_answered(host);
  const auto stats = host.bus.servo(1).stats;
  EXPECT_EQ(stats.queries, 3U * 28 + 3);
  EXPECT_EQ(stats.replies, stats.queries);
}

TEST(Servo, SendsNothingWithoutAQuery) {
  Host host(servo_config(1));
  host.wait(1s);
  EXPECT_TRUE(test::replies_of(host.bus).empty());
}

TEST(Servo, EchoesRepeatTheRequest) {
  Host host(servo_config(1));
  for (const char* text : {"141#31DE646432280A0B", "141#32DE646432280A0B", "141#34ADBEEF10270000",
                           "141#91010203 0405 6400", "141#95FFFFFFFFFFFFFF", "141#80DEADBEEFDEADBE",
                           "141#88DEADBEEFDEADBE", "141#81DEADBEEFDEADBE"}) {
    EXPECT_EQ(host.ask(text), frame(text));
  }
}

// --- registers

/// The reply before the write, after it, and after a power cycle.
TEST(Registers, RamIsLostAndRomKeptAtPowerOff) {
  struct Case {
    const char *write, *read, *before, *after, *restarted;
    unsigned rom_writes;
  };
  auto config = servo_config(1);
  config.rom.acceleration_dps_s = 720;
  for (const Case& c : {Case{"3100010203040506", "3000000000000000", "3000646432283232",
                             "3000010203040506", "3000646432283232", 0},
                        Case{"3200010203040506", "3000000000000000", "3000646432283232",
                             "3000010203040506", "3000010203040506", 1},
                        Case{"3400000010270000", "3300000000000000", "33000000D0020000",
                             "3300000010270000", "33000000D0020000", 0},
                        // A negative acceleration means no limit.
                        Case{"34000000FFFFFFFF", "3300000000000000", "33000000D0020000",
                             "3300000000000000", "33000000D0020000", 0}}) {
    SCOPED_TRACE(c.write);
    Host host(config);
    const std::string id = "141#";
    EXPECT_EQ(host.ask(id + c.read), frame(id + c.before));
    host.ask(id + c.write);
    EXPECT_EQ(host.ask(id + c.read), frame(id + c.after));
    host.bus.power_cycle(1);
    EXPECT_EQ(host.ask(id + c.read), frame(id + c.restarted));
    EXPECT_EQ(host.bus.stats().rom_writes, c.rom_writes);
  }
}

// --- angles

TEST(Angles, FollowTheBootAngle) {
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

/// The turn counter is unchanged until power-up.
TEST(Angles, OffsetWriteActsAtOnceOrAtPowerUp) {
  for (const bool at_once : {true, false}) {
    auto config = servo_config(1);
    config.quirks.offset_write_takes_effect = at_once;
    Host host(config);
    host.ask("141#910000000000 0004");  // 1024
    EXPECT_EQ(host.ask("141#9000000000000000"),
              frame(at_once ? "141#9000 0004 0008 0004" : "141#9000 0008 0008 0000"));
    EXPECT_EQ(host.single_turn_cdeg(), at_once ? 2250 : 4500);
    EXPECT_EQ(host.multi_turn_cdeg(), 4500);
    host.bus.power_cycle(1);
    EXPECT_EQ(host.ask("141#9000000000000000"), frame("141#9000 0004 0008 0004"));
    EXPECT_EQ(host.multi_turn_cdeg(), 2250);
  }
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

TEST(Angles, ClearAngleIsIgnoredOrValidUntilPowerOff) {
  for (const bool implemented : {false, true}) {
    auto config = servo_config(1);
    if (implemented) {
      config.quirks.dialect.clear_angle = protocol::ClearAngleMeaning::kImplemented;
    }
    Host host(config);
    host.ask("141#9500000000000000");
    EXPECT_EQ(host.multi_turn_cdeg(), implemented ? 0 : 4500);
    EXPECT_EQ(host.single_turn_cdeg(), implemented ? 0 : 4500);
    host.bus.power_cycle(1);
    EXPECT_EQ(host.multi_turn_cdeg(), 4500);
    EXPECT_EQ(host.single_turn_cdeg(), 4500);
  }
}

TEST(Angles, RandomBootAngleIsNeverZero) {
  std::set<std::int64_t> angles_cdeg;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    BusConfig config = test::bus_config({1, 2, 31, 32});
    config.seed = seed;
    for (auto& servo : config.servos) servo.boot_angle_deg.reset();
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

TEST(States, ContainTheValuesAtRest) {
  Host host(servo_config(1));
  host.wait(10ms);
  EXPECT_EQ(host.ask("141#9A00000000000000"), frame("141#9A 19 00 F000 0000 00"));  // 25 °C, 24.0 V
  EXPECT_EQ(host.ask("141#9B00000000000000"), frame("141#9B 19 00 F000 0000 00"));
  EXPECT_EQ(host.ask("141#9C00000000000000"), frame("141#9C 19 0000 0000 0008"));
  EXPECT_EQ(host.ask("141#9D00000000000000"), frame("141#9D 19 0000 0000 0000"));
}

TEST(States, PhaseCurrentsSumToZero) {
  Host host(servo_config(1));
  send(host, "141#A100000064000000", 5ms);
  const auto state = host.get<protocol::State3>(protocol::ReadState3{});
  EXPECT_NEAR(state.i_a_A + state.i_b_A + state.i_c_A, 0, 2.0 / 64);
  EXPECT_GT(std::abs(state.i_a_A) + std::abs(state.i_b_A) + std::abs(state.i_c_A), 1.6);
}

ServoConfig drive(Series series = Series::kMg) { return test::drive(Generation::kV236, series); }

/// Returns the reply to 0xC0 after 0xC1, which echoes the query.
protocol::Frame written(Host& host, const char* write) {
  const auto query = frame(write);
  EXPECT_EQ(host.ask(query), query);
  protocol::Frame read = frame("141#C000000000000000");
  read.data[1] = query.data[1];
  return host.ask(read);
}

struct Write {
  const char *write, *read;  // behind 141#C1 and 141#C0
};

void expect_read_back(Host& host, std::initializer_list<Write> writes) {
  for (const auto& [write, read] : writes) {
    const std::string query = "141#C1" + std::string(write);
    EXPECT_EQ(written(host, query.c_str()), frame("141#C0" + std::string(read))) << write;
  }
}

TEST(Parameters, HaveFactoryValues) {
  auto config = drive();
  config.rom.current_ramp_A_s = 25;
  config.rom.acceleration_dps_s = 720;
  config.rom.max_angle_deg = 360;
  Host host(config);
  EXPECT_EQ(host.ask("141#C00AFFFFFFFFFFFF"), frame("141#C00A640064000000"));
  for (const char* value : {"0B320028000000", "0C320032000000",
                            "1E0000E8030000",     // 1000
                            "20000080A21900",     // 16800.00 dps
                            "220000A08C0000",     // 360.00°
                            "240000A8610000",     // 25000 mA/s
                            "260000D0020000"}) {  // 720 dps/s
    const auto reply = frame("141#C0" + std::string(value));
    protocol::Frame query = frame("141#C000000000000000");
    query.data[1] = reply.data[1];
    EXPECT_EQ(host.ask(query), reply);
  }
}

TEST(Parameters, AreWrittenToRamAndReadBack) {
  Host host(drive());
  expect_read_back(host, {{"0A0102030405FF", "0A0102030405FF"},
                          {"0B640032000700", "0B640032000700"},
                          {"0CFFFFFFFFFFFF", "0CFFFFFFFFFFFF"},
                          {"1E55AAF4015555", "1E0000F4010000"},
                          {"200000A1860100", "200000A1860100"},
                          {"220000A18C0000", "220000A18C0000"},
                          {"24000001000000", "24000001000000"},
                          {"260000FFFFFF7F", "260000FFFFFF7F"}});
  EXPECT_EQ(host.bus.stats().rom_writes, 0U);
  host.bus.power_cycle(1);
  EXPECT_EQ(host.bus.servo(1).ram, host.bus.servo(1).config.rom);
}

TEST(Parameters, AreClampedToTheirRange) {
  Host host(drive());
  expect_read_back(host, {{"1E0000FF7F0000", "1E000000080000"},    // 2048
                          {"1E0000FFFF0000", "1E000000000000"},    //
                          {"20000000000000", "20000064000000"},    // 1 dps
                          {"200000FFFFFF7F", "20000000DD6D00"},    // 72000 dps
                          {"220000FFFFFF7F", "22000000CA9A3B"},    // 1e7°
                          {"220000FFFFFFFF", "22000000000000"},    //
                          {"24000000000080", "24000000000000"},    //
                          {"26000000000080", "26000000000000"},    //
                          {"240000FFFFFF7F", "24000000CA9A3B"}});  // 1e6 A/s
}

TEST(Parameters, MsHaveMaxPowerInstead) {
  Host host(drive(Series::kMs));
  EXPECT_EQ(host.ask("141#C01E000000000000"), frame("141#C01E000052030000"));  // 850
  expect_read_back(host,
                   {{"1E0000FF7F0000", "1E000052030000"}, {"1E000064000000", "1E000064000000"}});
  EXPECT_EQ(host.bus.servo(1).ram.max_torque_current_lsb, 1000);
}

TEST(Parameters, UnknownOnesGetNoReply) {
  Host host(drive());
  EXPECT_TRUE(host.talk(frame("141#C00D000000000000")).empty());
  EXPECT_TRUE(host.talk(frame("141#C10D000000000000")).empty());
  EXPECT_EQ(host.bus.servo(1).stats.unknown_commands, 2U);
  EXPECT_EQ(host.bus.servo(1).stats.queries, 0U);
}

// All values of the 16-bit parameter and as many of the others.
TEST(Parameters, EveryValueIsReadBack) {
  Host host(drive());
  struct Range {
    std::uint8_t id;
    std::int32_t first, last, step;
  };
  constexpr std::int32_t kLast = 7'000'000;
  for (const Range& c :
       {Range{0x1E, 0, 2048, 1}, Range{0x20, 100, kLast, 6997}, Range{0x22, 100, kLast, 6997},
        Range{0x24, 100, kLast, 6997}, Range{0x26, 100, kLast, 6997}}) {
    for (std::int32_t n = c.first; n <= c.last; n += c.step) {
      protocol::Frame value = frame("141#C100000000000000");
      value.data[1] = c.id;
      protocol::put_le(value.data, 4, n);
      host.ask(value);
      value.data[0] = 0xC0;
      protocol::Frame query = frame("141#C000000000000000");
      query.data[1] = c.id;
      ASSERT_EQ(host.ask(query), value);
    }
  }
}

TEST(Parameters, MaxTorqueCurrentLimitsTheLoops) {
  Host host(drive());
  host.ask("141#C11E000064000000");  // 100
  host.ask("141#A200000040420F00");
  EXPECT_NEAR(most_A(host), 100 * test::kMgLsb_A, 1e-9);
}

/// A speed, and a position 10000° away, both of 1000 dps.
TEST(Parameters, MaxSpeedLimitsTheCurrentCommand) {
  for (const char* command : {"141#A2000000A0860100", "141#A400E80340420F00"}) {
    SCOPED_TRACE(command);
    Host host(drive());
    send(host, command, 500ms);
    EXPECT_NEAR(speed_dps(host), 1000, 10);
    for (const auto& [limit, expected_dps] : {std::pair{"141#C1200000A08C0000", 360},
                                              {"141#C1200000E0930400", 1000},  // 3000 dps
                                              {"141#C1200000A08C0000", 360}}) {
      send(host, limit, 500ms);
      EXPECT_NEAR(speed_dps(host), expected_dps, 10);
    }
  }
}

TEST(Parameters, MaxSpeedStartsNoMotionWhileStopped) {
  Host host(drive());
  for (const char* query :
       {"141#A2000000A0860100", "141#8100000000000000", "141#C1200000A08C0000"}) {
    host.talk(frame(query), 100ms);
  }
  EXPECT_EQ(host.bus.truth(1).i_q_ref, 0);
}

TEST(Parameters, MaxSpeedDoesNotLimitSpeedCommandsOfSomeDialects) {
  auto config = drive();
  config.quirks.dialect.speed_iq_limit = false;
  Host host(config);
  send(host, {"141#A2000000A0860100", "141#C1200000A08C0000"}, 500ms);
  EXPECT_NEAR(speed_dps(host), 1000, 10);
}

TEST(Parameters, MaxAngleLimitsTheCurrentPositionCommand) {
  Host host(drive());
  host.ask("141#A300000020BF0200");        // 1800°
  send(host, "141#C1220000A08C0000", 1s);  // 360°
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 36000, 4);
  send(host, "141#C122000000000000", 1s);  // no limit
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 180000, 4);
  host.ask("141#9500000010270000");        // renames the present angle to 100°; the shaft stays
  send(host, "141#C122000088130000", 1s);  // 50°
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 10000, 4);
  send(host, "141#A300000010270000", 1s);  // a new command uses the new angles
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
TEST(Parameters, MaxTorqueCurrentDoesNotLimitMs) {
  for (const Generation generation : {Generation::kLegacy, Generation::kV236}) {
    auto config = drive(Series::kMs);
    config.quirks = quirks_of(generation);
    config.rom.max_torque_current_lsb = 1;
    Host host(config);
    host.ask("141#A200000040420F00");
    EXPECT_GT(most_A(host), 10);
  }
}

// A combination of switches that no generation has.
TEST(Parameters, ByteCommandsLeaveKdUnchanged) {
  auto config = drive();
  config.quirks.dialect.pid_commands = true;
  config.rom.gains.angle_kd = 7;
  Host host(config);
  host.ask("141#C10A0102030405FF");
  EXPECT_EQ(host.ask("141#3000000000000000"), frame("141#3000FFFF32283232"));  // at most 255
  host.ask("141#3100010203040506");
  EXPECT_EQ(host.ask("141#C00A000000000000"), frame("141#C00A0100020005FF"));
  host.ask("141#3200010203040506");
  EXPECT_EQ(host.bus.servo(1).ram.gains.angle_kd, 0xFF05);
  EXPECT_EQ(host.bus.servo(1).rom.gains.angle_kd, 7);
  EXPECT_EQ(host.bus.servo(1).rom.gains.current_ki, 6);
}

}  // namespace servo_test
}  // namespace lk::emulator
