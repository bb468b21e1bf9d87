// Every fault of firmware and memory, as a host observes it.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <variant>

#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace fault_firmware_test {

using State = FaultEvidence::State;
using namespace std::chrono_literals;
using test::answers;
using test::clear;
using test::evidence;
using test::Host;
using test::inject;

ServoConfig watched_drive() {
  ServoConfig config = test::servo_config(1);
  config.quirks.dialect.all_error_bits = true;
  config.rom.protections[static_cast<std::size_t>(model::Error::kLostInput)] = {true, 0.1, 0, 0};
  return config;
}

constexpr const char* kSpeed = "141#A200000050460000";  // 180 dps

bool has_speed_set_point(const Host& host) {
  return std::holds_alternative<model::Speed>(host.bus.state().setpoint(1));
}

constexpr auto kAllParameters = static_cast<FaultChoice>(kRomParameters);

constexpr const char* kWriteGains = "141#32000A0B0C0D0E0F";
constexpr const char* kReadGains = "141#3000000000000000";
const protocol::Frame kWrittenGains = test::frame("141#30000A0B0C0D0E0F");

std::vector<RomWrite> rom_writes(Host& host) {
  std::vector<RomWrite> writes;
  host.bus.take_rom_writes(writes);
  return writes;
}

void expect_once(const FaultEvidence& evidence, SimTime at) {
  EXPECT_EQ(evidence.began_at, at);
  EXPECT_EQ(evidence.first_effect_at, at);
  EXPECT_EQ(evidence.effects, 1U);
  EXPECT_EQ(evidence.first_on, "drive 1");
}

TEST(FirmwareFaults, ResetClearsTheRamOfAPoweredDrive) {
  Host host(test::powered_drive());
  host.ask("141#3400000068010000");  // acceleration 360 dps/s, RAM
  host.ask(kWriteGains);             // gains, ROM
  host.get<protocol::State2>(protocol::Position2{720, 40500});
  host.wait(2s);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 40500.0, 300.0);
  inject(host, "reset");
  expect_once(evidence(host), 2s);
  EXPECT_EQ(evidence(host).state, State::kOver);
  EXPECT_TRUE(answers(host));
  EXPECT_EQ(host.ask("141#3300000000000000"), test::frame("141#3300000000000000"));
  EXPECT_EQ(host.ask(kReadGains), kWrittenGains);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 4500.0, 300.0);  // one turn is lost

  host.bus.apply({1, SupplyVoltage{0.0}});
  host.wait(50ms);
  inject(host, "reset");
  EXPECT_EQ(evidence(host, 1).state, State::kOver);
  EXPECT_FALSE(evidence(host, 1).first_effect_at);
  EXPECT_FALSE(answers(host));
}

TEST(FirmwareFaults, HungDriveKeepsTurningAndGetsNoFrames) {
  Host host(test::servo_config(1));
  host.get<protocol::State2>(protocol::Speed{180, 0});
  host.wait(300ms);
  inject(host, "hang", {}, {.duration = 500ms});
  EXPECT_TRUE(host.talk(test::frame("141#A200000000000000")).empty());  // stop
  EXPECT_TRUE(host.talk(test::frame("280#0000000000000000")).empty());
  host.wait(400ms);
  EXPECT_NEAR(host.bus.truth(1).omega_m / std::numbers::pi * 180, 180.0, 3.0);
  EXPECT_EQ(evidence(host).effects, 1U);  // 0x280 would not have been answered anyway
  EXPECT_EQ(evidence(host).first_effect_at, 300ms);
  EXPECT_EQ(evidence(host).first_on, "drive 1, 141#A200000000000000");
  host.wait(100ms);
  EXPECT_NEAR(host.state_2().speed_dps, 180.0, test::kSpeedStep_dps);
}

TEST(FirmwareFaults, HungDriveLosesItsInput) {
  Host host(watched_drive());
  inject(host, "hang", {}, {.duration = 150ms});
  for (int n = 0; n < 15; ++n) host.talk(test::frame("141#9C00000000000000"), 10ms);
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(host.get<protocol::State1>(protocol::ReadState1{}).errors,
            model::bit(model::Error::kLostInput));
}

TEST(FirmwareFaults, SlowRepliesDelayOnlyTheReply) {
  Host host(test::servo_config(1));
  inject(host, "slow_replies", {5}, {.duration = 100ms});
  host.bus.receive({0ns, test::frame("141#A1000000C8000000")});  // 3.2 A
  std::vector<TimedFrame> replies;
  host.wait(4999us);
  host.bus.take_replies(replies);
  EXPECT_TRUE(replies.empty());
  EXPECT_NEAR(host.bus.truth(1).i_q, 3.2, 0.1);
  host.wait(1us);
  host.bus.take_replies(replies);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0].at, 5ms);
  EXPECT_EQ(evidence(host).effects, 1U);
  EXPECT_EQ(evidence(host).first_effect_at, 0ns);
  host.wait(100ms);
  EXPECT_TRUE(answers(host));  // the reply comes at once
  EXPECT_EQ(evidence(host).effects, 1U);
}

/// Only the third acts: the first is over before the query, the second is of another drive.
TEST(FirmwareFaults, ActOnlyOnTheirDriveInTheirTime) {
  struct Row {
    const char* kind;
    std::array<std::vector<FaultValue>, 3> values;
    const char* query;
    SimTime reply_at;
  };
  for (const Row& row : {Row{"slow_replies", {{{3}, {7}, {5}}}, "141#9C00000000000000", 15ms},
                         Row{"rom_write_fails", {}, kWriteGains, 10ms}}) {
    SCOPED_TRACE(row.kind);
    Host host(test::bus_config({1, 2}));
    for (const std::size_t n : {0U, 1U, 2U}) {
      const auto duration = n == 0 ? std::optional(SimTime{1ms}) : std::nullopt;
      inject(host, row.kind, row.values[n], {.duration = duration}, {n == 1 ? 2 : 1});
    }
    host.wait(10ms);
    host.bus.receive({10ms, test::frame(row.query)});
    host.wait(50ms);
    std::vector<TimedFrame> replies;
    host.bus.take_replies(replies);
    ASSERT_EQ(replies.size(), 1U);
    EXPECT_EQ(replies[0].at, row.reply_at);
    for (const std::size_t n : {0U, 1U, 2U}) EXPECT_EQ(evidence(host, n).effects, n / 2) << n;
    EXPECT_EQ(evidence(host, 2).first_effect_at, 10ms);
  }
}

TEST(FirmwareFaults, ReplyTo9BShowsTheErrorsBeforeTheyAreCleared) {
  for (const bool before : {false, true}) {
    Host host(watched_drive());
    if (before) inject(host, "clear_reply_before");
    host.wait(200ms);  // trips lost input
    EXPECT_EQ(host.ask("141#9B00000000000000").data[7], before ? 0x80 : 0x00);
    EXPECT_EQ(host.ask("141#9A00000000000000").data[7], 0x00);
    EXPECT_EQ(host.ask("141#9B00000000000000").data[7], 0x00);  // no error left
    if (before) {
      EXPECT_EQ(evidence(host).effects, 1U);
    }
  }
}

TEST(FirmwareFaults, FirstMotionCommandAfterATimeOutIsAnsweredOnly) {
  Host host(watched_drive());
  inject(host, "first_command_lost");
  host.ask(kSpeed);  // 180 dps: no time-out yet
  EXPECT_TRUE(has_speed_set_point(host));
  host.wait(200ms);
  host.ask(kSpeed);  // refused, so not counted
  host.ask("141#9B00000000000000");
  host.ask("141#8800000000000000");
  EXPECT_EQ(evidence(host).effects, 0U);
  EXPECT_EQ(host.ask(kSpeed).data[0], 0xA2);
  EXPECT_FALSE(has_speed_set_point(host));
  EXPECT_EQ(evidence(host).effects, 1U);
  host.ask(kSpeed);
  EXPECT_TRUE(has_speed_set_point(host));
  EXPECT_EQ(evidence(host).effects, 1U);
}

TEST(FirmwareFaults, FirstMotionCommandIsLostAfterTheChosenEvent) {
  const std::vector<std::pair<LostAfter, std::string_view>> cases = {
      {LostAfter::kClear, "141#9B00000000000000"}, {LostAfter::kOff, "141#8000000000000000"}};
  for (const auto& [after, command] : cases) {
    Host host(test::servo_config(1));
    inject(host, "first_command_lost", {after});
    for (const auto& [other, other_command] : cases) {
      host.ask(other_command);
      host.ask(kSpeed);
      EXPECT_EQ(has_speed_set_point(host), other != after);
      host.ask(kSpeed);
      EXPECT_TRUE(has_speed_set_point(host));
    }
  }
  Host host(test::servo_config(1));
  inject(host, "first_command_lost", {LostAfter::kBoot});
  host.bus.power_cycle(1);
  host.ask(kSpeed);
  EXPECT_FALSE(has_speed_set_point(host));
}

TEST(FirmwareFaults, DriveHoldingTheBusAfterOffIsSilentUntilARestart) {
  Host host(test::servo_config(1));
  inject(host, "bus_held_after_off");
  EXPECT_TRUE(answers(host));
  host.ask("141#8000000000000000");  // acknowledged by an echo
  EXPECT_FALSE(answers(host));
  EXPECT_EQ(evidence(host).effects, 1U);
  EXPECT_TRUE(host.talk(test::frame(kSpeed)).empty());
  EXPECT_TRUE(has_speed_set_point(host));
  clear(host);
  EXPECT_FALSE(answers(host));
  host.bus.power_cycle(1);
  EXPECT_TRUE(answers(host));
  EXPECT_EQ(host.bus.stats().replies_lost, 3U);
}

TEST(FirmwareFaults, MultiTurnAngleStartsWrong) {
  struct Row {
    const char* kind;
    std::vector<FaultValue> values;
    int angle_cdeg;
  };
  for (const Row& row :
       {Row{"encoder_wrap_at_boot", {1}, 4500 + 36000},
        Row{"encoder_wrap_at_boot", {-2}, 4500 - 72000}, Row{"multi_turn_zero_at_boot", {}, 0}}) {
    Host host(test::servo_config(1));
    inject(host, row.kind, row.values);
    EXPECT_EQ(host.multi_turn_cdeg(), 4500);
    host.bus.power_cycle(1);
    EXPECT_EQ(host.multi_turn_cdeg(), row.angle_cdeg);
    EXPECT_EQ(host.single_turn_cdeg(), 4500);
    EXPECT_EQ(evidence(host).effects, 1U);
    clear(host);
    host.bus.power_cycle(1);
    EXPECT_EQ(host.multi_turn_cdeg(), 4500);
  }
}

// --- memory

void restart(Host& host) {
  host.bus.apply({1, PowerCycle{}});
  host.wait(1s);
}

class LostWrites : public testing::TestWithParam<const char*> {};

TEST_P(LostWrites, AreAcknowledgedAndGoneAfterARestart) {
  Host host(test::powered_drive());
  host.ask("141#3200010203040506");
  const RomWear wear = host.bus.servo(1).wear;
  rom_writes(host);

  inject(host, GetParam());
  EXPECT_FALSE(evidence(host).first_effect_at);
  EXPECT_EQ(host.ask(kWriteGains), test::frame(kWriteGains));
  EXPECT_EQ(host.ask(kReadGains), kWrittenGains);  // RAM
  expect_once(evidence(host), 0ns);
  // The owner of the ROM is notified of the write, with the ROM's contents.
  const auto writes = rom_writes(host);
  ASSERT_EQ(writes.size(), 1U);
  EXPECT_EQ(writes[0].number, 2U);
  EXPECT_EQ(writes[0].rom.gains.angle_kp, 1);
  EXPECT_EQ(writes[0].wear, wear);
  restart(host);
  EXPECT_EQ(host.ask(kReadGains), test::frame("141#3000010203040506"));

  Registers wanted = host.bus.servo(1).rom;
  wanted.max_speed_dps = 77;
  EXPECT_TRUE(host.bus.write_setting(1, RomParameter::kMaxSpeed, wanted));
  EXPECT_EQ(host.bus.servo(1).ram.max_speed_dps, 77);
  EXPECT_NE(host.bus.servo(1).rom.max_speed_dps, 77);
  EXPECT_EQ(evidence(host).effects, 2U);

  clear(host);
  host.ask(kWriteGains);
  restart(host);
  EXPECT_EQ(host.ask(kReadGains), kWrittenGains);
  EXPECT_EQ(evidence(host).effects, 2U);
}
INSTANTIATE_TEST_SUITE_P(MemoryFaults, LostWrites, testing::Values("rom_write_fails", "rom_worn"),
                         [](const auto& test) { return std::string(test.param); });

TEST(MemoryFaults, EqualFaultsBothHaveEvidence) {
  Host host(test::powered_drive());
  inject(host, "rom_write_fails");
  inject(host, "rom_write_fails");
  host.ask(kWriteGains);
  for (std::size_t n = 0; n < 2; ++n) expect_once(evidence(host, n), 0ns);
}

TEST(MemoryFaults, DamagedParameterHasItsFactoryValueAfterARestart) {
  Host host(test::powered_drive());
  host.ask(kWriteGains);
  host.ask("141#9100000000000100");  // encoder offset 1 count
  rom_writes(host);
  inject(host, "rom_damaged", {RomParameter::kGains});
  expect_once(evidence(host), 0ns);
  EXPECT_EQ(host.ask(kReadGains), kWrittenGains);  // RAM
  // The stored copy is damaged as well.
  const auto writes = rom_writes(host);
  ASSERT_EQ(writes.size(), 1U);
  EXPECT_EQ(writes[0].number, 3U);
  EXPECT_EQ(writes[0].rom.gains, model::GainBytes{});
  EXPECT_EQ(writes[0].rom.encoder_offset, 1);
  restart(host);
  EXPECT_EQ(host.ask(kReadGains), test::frame("141#3000646432283232"));  // factory
  EXPECT_EQ(host.get<protocol::Encoder>(protocol::ReadEncoder{}).offset_counts, 1);
  inject(host, "rom_damaged", {kAllParameters});
  restart(host);
  EXPECT_EQ(host.get<protocol::Encoder>(protocol::ReadEncoder{}).offset_counts, 0);
  EXPECT_EQ(host.bus.servo(1).rom, Profile{}.factory);
  EXPECT_EQ(rom_writes(host).back().number, 4U);
}

TEST(MemoryFaults, DamageOutlastsAWriteInProgress) {
  ServoConfig config = test::powered_drive();
  config.rom.max_speed_dps = 500;
  config.flash.write_time = 20ms;
  for (const bool cut_short : {false, true}) {
    Host host(config);
    host.bus.receive({0ns, test::frame(kWriteGains)});
    host.wait(10ms);
    inject(host, "rom_damaged", {RomParameter::kMaxSpeed});
    if (cut_short) host.bus.power_cycle(1);
    host.wait(20ms);
    const auto writes = rom_writes(host);
    ASSERT_EQ(writes.size(), cut_short ? 0U : 1U);
    if (!cut_short) {
      EXPECT_EQ(writes[0].rom.max_speed_dps, Registers{}.max_speed_dps);
    }
    EXPECT_EQ(host.bus.servo(1).rom.max_speed_dps, Registers{}.max_speed_dps);
    EXPECT_EQ(host.bus.servo(1).rom.gains.angle_kp, cut_short ? 100 : 10);
  }
}

/// Returns the number of differing bits in the integer parts of two values.
int bits_apart(double a, double b) {
  const auto whole = [](double value) { return static_cast<std::uint64_t>(value); };
  return std::popcount(whole(a) ^ whole(b));
}

TEST(MemoryFaults, FlippedBitKeepsTheRangeOfTheRegister) {
  for (const Generation generation : {Generation::kLegacy, Generation::kV236}) {
    ServoConfig config = test::drive(generation);
    config.rom.max_torque_current_lsb = config.quirks.dialect.iq_command_limit_lsb;
    config.rom.encoder_offset = 16383;
    config.rom.max_speed_dps = 1.25;
    config.rom.max_angle_deg = 360.5;
    for (std::uint64_t seed = 1; seed < 200; ++seed) {
      BusConfig bus = test::bus_config({});
      bus.servos.push_back(config);
      bus.seed = seed;
      Host host(bus);
      for (int p = 0; p < 9; ++p) inject(host, "ram_flipped", {static_cast<RomParameter>(p)});
      for (std::size_t p = 0; p < 9; ++p) expect_once(evidence(host, p), 0ns);
      const Registers& ram = host.bus.servo(1).ram;
      const auto& gains = ram.gains;
      const std::pair<int, int> gain_rows[] = {{gains.angle_kp, 100},  {gains.angle_ki, 100},
                                               {gains.speed_kp, 50},   {gains.speed_ki, 40},
                                               {gains.current_kp, 50}, {gains.current_ki, 50}};
      int gain_bits = 0;
      for (const auto& [gain, before] : gain_rows) {
        gain_bits += bits_apart(gain, before);
        EXPECT_LE(gain, generation == Generation::kLegacy ? 255 : 65535);
      }
      EXPECT_EQ(gain_bits, 1);
      const double limit_lsb = config.quirks.dialect.iq_command_limit_lsb;
      struct Flip {
        double now, before, most;
      };
      for (const Flip& flip :
           {Flip{0.0 + ram.acceleration_dps_s, 0, INT32_MAX},
            Flip{0.0 + ram.encoder_offset, 16383, 16383},
            Flip{0.0 + ram.max_torque_current_lsb, limit_lsb, limit_lsb},
            Flip{0.0 + ram.max_power_permille, 850, 850}, Flip{ram.max_speed_dps, 1, 72'000},
            Flip{ram.max_angle_deg, 360, 1e7}, Flip{ram.current_ramp_A_s, 0, 1e6}}) {
        EXPECT_EQ(bits_apart(flip.now, flip.before), 1);
        EXPECT_LE(flip.now, flip.most);
      }
      EXPECT_GT(ram.acceleration_dps_s, 0);
      EXPECT_GE(ram.max_speed_dps, 1);
      EXPECT_EQ(ram.max_speed_dps - std::floor(ram.max_speed_dps), 0.25);
      EXPECT_TRUE(ram.broadcast_mode);
      EXPECT_EQ(host.bus.servo(1).rom, config.rom);
      if (testing::Test::HasFailure()) return;
    }
  }
}

/// The ROM of a newer firmware in a drive with gains of one byte: no single bit flip gives 0x300.
TEST(MemoryFaults, NoBitFlipsIfEachLeavesTheRange) {
  ServoConfig config = test::drive(Generation::kLegacy);
  config.rom.gains = {0x300, 0x300, 0x300, 0x300, 0x300, 0x300};
  Host host(config);
  inject(host, "ram_flipped", {RomParameter::kGains});
  EXPECT_EQ(host.bus.servo(1).ram, config.rom);
  EXPECT_EQ(evidence(host).state, FaultEvidence::State::kOver);
  EXPECT_EQ(evidence(host).effects, 0U);
}

TEST(MemoryFaults, FlippedBitLastsUntilARestart) {
  Host host(test::powered_drive());
  host.get<protocol::State2>(protocol::Position2{0, 36000});
  inject(host, "ram_flipped", {RomParameter::kEncoderOffset});
  const auto now = host.get<protocol::Encoder>(protocol::ReadEncoder{});
  EXPECT_EQ(std::popcount(now.offset_counts), 1);
  EXPECT_EQ((now.encoder_counts + now.offset_counts) % 16384, 2048);
  restart(host);
  EXPECT_EQ(host.get<protocol::Encoder>(protocol::ReadEncoder{}).offset_counts, 0);
  host.bus.apply({1, SupplyVoltage{0.0}});
  host.wait(50ms);
  inject(host, "ram_flipped", {RomParameter::kGains});
  EXPECT_FALSE(evidence(host, 1).first_effect_at) << "there is no RAM without power";
}

TEST(MemoryFaults, RestartLosesTheBroadcastMode) {
  ServoConfig config = test::powered_drive();
  config.rom.broadcast_mode = true;
  Host host(config);
  inject(host, "forgets_broadcast");
  EXPECT_FALSE(answers(host));  // still in the mode until the restart
  EXPECT_FALSE(evidence(host).first_effect_at);
  restart(host);
  EXPECT_TRUE(answers(host));
  EXPECT_TRUE(host.talk(test::frame("280#0000000000000000")).empty());
  EXPECT_EQ(evidence(host).effects, 1U);
  EXPECT_GT(evidence(host).first_effect_at, 500ms);
  EXPECT_TRUE(host.bus.servo(1).rom.broadcast_mode);
  clear(host);
  restart(host);
  EXPECT_FALSE(answers(host));
}

TEST(MemoryFaults, ResetLosesTheLimits) {
  ServoConfig config = test::powered_drive();
  config.rom.max_speed_dps = 90;
  config.rom.gains.speed_kp = 60;
  Host host(config);
  const auto speed_dps = [&] {
    host.get<protocol::State2>(protocol::Position1{1'000'000});
    host.wait(500ms);
    return host.state_2().speed_dps;
  };
  EXPECT_NEAR(speed_dps(), 90.0, test::kSpeedStep_dps);
  inject(host, "forgets_limits");
  inject(host, "reset");
  EXPECT_EQ(evidence(host).first_effect_at, host.bus.time());
  EXPECT_EQ(evidence(host).effects, 1U);
  EXPECT_EQ(host.bus.servo(1).ram.max_speed_dps, Registers{}.max_speed_dps);
  EXPECT_EQ(host.bus.servo(1).ram.gains.speed_kp, 60);  // no limit
  EXPECT_GT(speed_dps(), 500.0);
  clear(host);
  inject(host, "reset");
  EXPECT_NEAR(speed_dps(), 90.0, test::kSpeedStep_dps);
}

TEST(MemoryFaults, LosingFactoryValuesHasNoEffect) {
  Host host(test::powered_drive());
  inject(host, "forgets_broadcast");
  inject(host, "forgets_limits");
  inject(host, "reset");
  EXPECT_FALSE(evidence(host, 0).first_effect_at);
  EXPECT_FALSE(evidence(host, 1).first_effect_at);
}

}  // namespace fault_firmware_test
}  // namespace lk::emulator
