// Generations and series of drives on a bus: answered commands, formats, effects.

#include "emulator/core/generation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <set>

#include "tests/emulator/core/core_support.hpp"

namespace lk::emulator {
namespace generation_test {

using namespace std::chrono_literals;
using test::drive;
using test::frame;
using test::Host;
using test::kMfLsb_A;
using test::kMgLsb_A;
using test::most_A;
using test::send;

/// Parameters of an MG4005-i10 that affect its angles.
ServoConfig mg4005(Generation generation, double boot_angle_deg) {
  ServoConfig config = drive(generation);
  config.profile.drive.encoder.bits = 18;
  config.profile.drive.mechanics.gear_ratio = 10;
  config.profile.encoder_span = EncoderSpan::kOutputTurn;
  config.boot_angle_deg = boot_angle_deg;
  return config;
}

double truth_deg(const Host& host) { return host.bus.truth(1).theta_m * 180 / std::numbers::pi; }

// --- answered commands

TEST(Generation, LegacyIsTheDefault) { EXPECT_EQ(quirks_of(Generation::kLegacy), Quirks{}); }

/// docs/reference/protocol.md §4.1: the manuals of V2.35 and V2.36 require 0x88 after 0x80, the
/// first one does not.
TEST(Generation, NewerDrivesNeedRunAfterOff) {
  for (const auto& [generation, waits] :
       {std::pair(Generation::kLegacy, false), std::pair(Generation::kLateLegacy, false),
        std::pair(Generation::kV235, true), std::pair(Generation::kV236, true)}) {
    Host host(drive(generation));
    send(host, {"141#8000000000000000", "141#A200000010270000"});
    EXPECT_EQ(host.run_state() == RunState::kOff, waits) << generation_name(generation);
    EXPECT_EQ(host.bus.stats().refused_motion, waits ? 1U : 0U) << generation_name(generation);
  }
}

using Bytes = std::set<unsigned>;

/// Command bytes of each generation and series by the vendor's manuals. Written by hand, not
/// derived from the tables under test. `late-legacy` has the commands of `legacy`.
const Bytes kLegacyBytes{0x19, 0x30, 0x31, 0x32, 0x33, 0x34, 0x37, 0x38, 0x80, 0x81,
                         0x88, 0x90, 0x91, 0x92, 0x94, 0x95, 0x9A, 0x9B, 0x9C, 0x9D,
                         0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8};
const Bytes kV235Bytes{0x19, 0x80, 0x81, 0x88, 0x90, 0x91, 0x92, 0x94, 0x95, 0x9A, 0x9B,
                       0x9C, 0x9D, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8};
const Bytes kV236Bytes{0x19, 0x80, 0x81, 0x88, 0x8C, 0x90, 0x92, 0x94, 0x95, 0x9A, 0x9B, 0x9C,
                       0x9D, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8, 0xC0, 0xC1};

/// MS drives have no currents (0x9D, 0xA1); from V2.35 on they have open-loop power (0xA0).
Bytes bytes_of_ms(Bytes bytes, bool legacy) {
  bytes.erase(0x9D);
  bytes.erase(0xA1);
  if (!legacy) bytes.insert(0xA0);
  return bytes;
}

TEST(Generation, AnswersWhatTheManualsSay) {
  struct Case {
    Generation generation;
    const Bytes& bytes;
  };
  const Series kSeries[] = {Series::kMs, Series::kMf, Series::kMg, Series::kMh};
  for (const Case& c :
       {Case{Generation::kLegacy, kLegacyBytes}, Case{Generation::kLateLegacy, kLegacyBytes},
        Case{Generation::kV235, kV235Bytes}, Case{Generation::kV236, kV236Bytes}}) {
    for (const Series series : kSeries) {
      const bool legacy = &c.bytes == &kLegacyBytes;
      const Bytes expected = series == Series::kMs ? bytes_of_ms(c.bytes, legacy) : c.bytes;
      Host host(drive(c.generation, series));
      Bytes answered;
      for (unsigned byte = 0; byte < 256; ++byte) {
        protocol::Frame query = frame("141#000A000000000000");
        query.data[0] = static_cast<std::uint8_t>(byte);
        const auto replies = host.talk(query);
        ASSERT_LE(replies.size(), 1U) << byte;
        if (replies.empty()) continue;
        answered.insert(byte);
        EXPECT_EQ(replies[0].data[0], byte);
      }
      EXPECT_EQ(answered, expected)
          << static_cast<int>(c.generation) << ' ' << static_cast<int>(series);
      const std::uint64_t silent = 256 - expected.size();
      EXPECT_EQ(host.bus.servo(1).stats.unknown_commands, silent);
      EXPECT_EQ(host.bus.stats().count(Drop::kUnknownCommand), silent);
    }
  }
}

TEST(Generation, ReplyIdentifiersAreConfigurable) {
  auto config = drive(Generation::kV236, Series::kMg, 3);
  config.quirks.dialect.reply_id_base = 0x180;
  Host host(config);
  EXPECT_EQ(host.ask("143#8C10000000000000"), frame("183#8C00000000000000"));
}

// --- captures of real drives

TEST(Generation, StateAtRestMatchesRealDrives) {
  struct Capture {
    const char* text;
    double temperature_C, voltage_V;
  };
  for (const Capture& capture : {Capture{"141#9A24081300000000", 36, 48.72},     // MG6010E-i6
                                 Capture{"141#9A1F540900000000", 31, 23.88}}) {  // MG4005-i10
    auto config = drive(Generation::kV236);
    config.profile.drive.thermal.temp_ambient = capture.temperature_C;
    config.profile.drive.supply.v_source = capture.voltage_V;
    Host host(config);
    host.wait(50ms);
    EXPECT_EQ(host.ask("141#9A00000000000000"), frame(capture.text));
  }
}

// Angle and encoder field of a real MG4005-i10. The encoder has steps of 0.055°, the angle of
// 0.01°, so a pair fixes the true angle only within five steps. All pairs are correct if the field
// is rounded down.
TEST(Generation, AnglesMatchARealDrive) {
  struct Reading {
    int angle_cdeg;
    int encoder;
  };
  for (const auto& reading :
       {Reading{9811, 1786}, Reading{80986, 14743}, Reading{67425, 12274}, Reading{892, 162}}) {
    Host host(mg4005(Generation::kV236, reading.angle_cdeg / 100.0));
    host.wait(5ms);
    EXPECT_EQ(host.multi_turn_cdeg(), reading.angle_cdeg);
    EXPECT_EQ(host.single_turn_cdeg(), reading.angle_cdeg);
    EXPECT_EQ(host.get<protocol::Encoder>(protocol::ReadEncoder{}).encoder_counts, reading.encoder);
    EXPECT_EQ(host.state_2().encoder_counts, reading.encoder);
  }
}

void expect_at_45_deg(int bits, EncoderSpan span, Generation generation, double offset_turns) {
  SCOPED_TRACE(testing::Message() << bits << " bit, " << offset_turns << " of a turn");
  auto config = drive(generation);
  config.profile.drive.encoder.bits = bits;
  config.profile.drive.mechanics.gear_ratio = 10;
  config.profile.encoder_span = span;
  const int turn = 1 << std::min(bits, 16);
  const int offset = static_cast<int>(offset_turns * turn);
  config.rom.encoder_offset = static_cast<std::uint16_t>(offset);
  Host host(config);
  const int expected = span == EncoderSpan::kRotorTurn ? turn / 8 : turn / 80;  // 45°
  const auto encoder = host.get<protocol::Encoder>(protocol::ReadEncoder{});
  // If ten rotor turns share the field, 45° need not be a whole number of counts.
  const int slack = span == EncoderSpan::kRotorTurn ? 0 : 1;
  EXPECT_NEAR(encoder.encoder_counts, expected, slack);
  EXPECT_NEAR(encoder.raw_counts, (expected + offset) % turn, slack);
  EXPECT_EQ(encoder.offset_counts, offset);
  EXPECT_NEAR(host.single_turn_cdeg(), 4500, 36000.0 / (1 << bits));
  EXPECT_EQ(host.bus.servo(1).ram.encoder_offset, offset);
}

TEST(Generation, EncodersOfEveryWidthShowTheirAngle) {
  for (const int bits : {12, 14, 15, 16, 18}) {
    for (const EncoderSpan span : {EncoderSpan::kRotorTurn, EncoderSpan::kOutputTurn}) {
      for (const Generation generation : {Generation::kLegacy, Generation::kV236}) {
        // If a field spans ten rotor turns, the last two offsets are beyond the first turn.
        for (const double offset_turns : {0.01, 0.55, 0.995}) {
          expect_at_45_deg(bits, span, generation, offset_turns);
        }
      }
    }
  }
}

// docs/reference/protocol.md §10.1: DATA[0] of the query, 24.0 V at 3–4, one turn of the output at
// 4–7.
TEST(Generation, LateLegacyMixesBothFormats) {
  Host host(mg4005(Generation::kLateLegacy, 3599.0));
  EXPECT_EQ(host.ask("141#9A00000000000000"), frame("141#9A1900F000000000"));
  EXPECT_EQ(host.ask("141#9B00000000000000"), frame("141#9B1900F000000000"));
  EXPECT_EQ(host.ask("141#9400000000000000"), frame("141#94000000DC7D0500"));  // 359900
  EXPECT_EQ(host.multi_turn_cdeg(), -100);
  EXPECT_EQ(host.ask("141#A700000000000000").data[0], 0xA7);
  EXPECT_EQ(host.ask("141#9501020304050607"), frame("141#9501020304050607"));
  EXPECT_EQ(host.multi_turn_cdeg(), -100) << "ignored";
  send(host, "141#A10000000008 0000", 1ms);  // 2048
  EXPECT_NEAR(host.bus.truth(1).i_q_ref, 33, 1e-9);
  Host mf(drive(Generation::kLateLegacy, Series::kMf));
  send(mf, "141#A100000000080000", 1ms);
  EXPECT_NEAR(mf.bus.truth(1).i_q_ref, 16.5, 1e-9);
}

// --- state 1

TEST(Generation, NewerStatesContainOffAndAllErrors) {
  for (const Generation generation : {Generation::kLegacy, Generation::kV236}) {
    auto config = drive(generation);
    config.rom.protections[1] = {true, 60.0, 1.0, 0.001};  // over-voltage
    Host host(config);
    host.ask("141#8000000000000000");
    const bool legacy = generation == Generation::kLegacy;
    EXPECT_EQ(host.ask("141#9A00000000000000"),
              legacy ? frame("141#9A1900F000000000") : frame("141#9A19600900001000"));
    host.ask("141#8800000000000000");
    test::supply(host, 70, 20ms);
    const auto reply = host.ask("141#9A00000000000000");
    EXPECT_EQ(reply.data[7], legacy ? 0x00 : 0x02);
    EXPECT_EQ(reply.data[6], legacy ? 0x00 : 0x10);
  }
}

TEST(Generation, BusCurrentIsMeasured) {
  Host host(drive(Generation::kV236));
  send(host, protocol::encode_query(1, protocol::Torque{4}, host.bus.servo(1).format), 30ms);
  const double expected_A = host.bus.telemetry(1).i_bus;
  EXPECT_GT(expected_A, 0.1);
  const auto state = host.get<protocol::State1>(protocol::ReadState1{});
  EXPECT_NEAR(state.bus_current_A, expected_A, 0.005);
  EXPECT_TRUE(state.bridge_on);
}

TEST(Generation, CurrentScaleDependsOnTheSeries) {
  for (const Series series : {Series::kMf, Series::kMg}) {
    const double lsb_A = series == Series::kMg ? kMgLsb_A : kMfLsb_A;
    Host host(drive(Generation::kV236, series));
    send(host, "141#A100000064000000", 5ms);  // 100
    EXPECT_NEAR(host.bus.truth(1).i_q_ref, 100 * lsb_A, 1e-9);
    const auto reply = host.ask("141#9C00000000000000");
    EXPECT_NEAR(protocol::get_le<std::int16_t>(reply.data, 2), host.bus.telemetry(1).i_q / lsb_A,
                0.5);
    EXPECT_NEAR(protocol::get_le<std::int16_t>(reply.data, 2), 100, 3);
  }
}

// --- angles

TEST(Generation, SingleTurnAngleCoversTheOutputTurn) {
  Host host(mg4005(Generation::kV236, 3599.0));
  EXPECT_EQ(host.ask("141#9400000000000000"), frame("141#94000000DC7D0500"));  // 359900
  EXPECT_EQ(host.multi_turn_cdeg(), -100);  // half an output turn to either side
  host.ask("141#8000000000000000");         // as after power-up
  EXPECT_EQ(host.multi_turn_cdeg(), -100);
  auto half_turn = mg4005(Generation::kV236, 2050.0);
  EXPECT_EQ(Host(half_turn).multi_turn_cdeg(), 205000 - 360000);
  half_turn.quirks.boot_wrap = BootWrap::kHalfTurn;
  Host wrapped(half_turn);
  EXPECT_EQ(wrapped.multi_turn_cdeg(), -11000);
  send(wrapped, "141#A3000000E0930400", 2s);  // 3000°
  wrapped.ask("141#8000000000000000");
  EXPECT_NEAR(static_cast<double>(wrapped.multi_turn_cdeg()), 12000, 10);
  Host legacy(mg4005(Generation::kLegacy, 3599.0));
  EXPECT_EQ(legacy.ask("141#9400000000000000"), frame("141#9400000000003C8C"));  // 35900
  // A real drive with 19631 of 65536 counts per output turn received 0xA4 1078.44° at power-up and
  // did not move.
  Host log(mg4005(Generation::kLegacy, 1078.37));
  EXPECT_EQ(protocol::get_le<std::uint16_t>(log.ask("141#9000000000000000").data, 4), 19631);
  EXPECT_NEAR(static_cast<double>(log.multi_turn_cdeg()), 107844, 11);  // two counts
  EXPECT_EQ(Host(mg4005(Generation::kLegacy, 3599.0)).multi_turn_cdeg(), -100);
  Host rotor(drive(Generation::kV236));
  EXPECT_EQ(rotor.ask("141#9400000000000000"), frame("141#9400000094110000"));
}

// docs/reference/protocol.md §7: the initial multi-turn angle and the effect of 0x80 on it are
// independent.
TEST(Generation, MultiTurnAngleStartsAtZeroIfConfigured) {
  auto config = mg4005(Generation::kV236, 90);
  config.quirks.boot_multi_turn = BootMultiTurn::kZero;
  Host host(config);
  EXPECT_EQ(host.ask("141#9200000000000000"), frame("141#9200000000000000"));
  EXPECT_EQ(host.single_turn_cdeg(), 9000) << "the encoder knows where it stands";
  send(host, "141#A300000028230000", 2s);  // 90° from here
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 9000, 10);
  EXPECT_NEAR(static_cast<double>(host.single_turn_cdeg()), 18000, 10);
  host.ask("141#8000000000000000");
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 18000, 10) << "single-turn again";

  config.quirks.off_multi_turn = OffMultiTurn::kAsBoot;
  Host as_boot(config);
  send(as_boot, "141#A300000028230000", 2s);
  as_boot.ask("141#8000000000000000");
  EXPECT_EQ(as_boot.multi_turn_cdeg(), 0);
  as_boot.bus.power_cycle(1);
  EXPECT_EQ(as_boot.multi_turn_cdeg(), 0);
  config.quirks.boot_multi_turn = BootMultiTurn::kSingleTurn;
  Host wrapped(config);
  wrapped.ask("141#8000000000000000");
  EXPECT_EQ(wrapped.multi_turn_cdeg(), 9000);
}

// docs/reference/protocol.md §4: the under-voltage is over; 0x9B clears it, independent of the
// shown flags.
TEST(Generation, ClearReplyShowsEarlierFlagsIfConfigured) {
  for (const auto& [generation, shown] : {std::pair{Generation::kV236, ClearReply::kAfter},
                                          {Generation::kV236, ClearReply::kBefore},
                                          {Generation::kV236b, ClearReply::kBefore}}) {
    auto config = drive(generation);
    config.quirks.clear_reply = shown;
    config.rom.protections[0] = {.enabled = true, .threshold = 18, .hysteresis = 1};
    Host host(config);
    test::supply(host, 15, 500ms);
    test::supply(host, 24, 500ms);
    ASSERT_EQ(host.ask("141#9A00000000000000").data[7], 1);
    const auto cleared = host.ask("141#9B00000000000000");
    EXPECT_EQ(cleared.data[6], 0x10);  // the bridge is off
    EXPECT_EQ(cleared.data[7], shown == ClearReply::kBefore ? 1 : 0);
    EXPECT_EQ(host.ask("141#9A00000000000000").data[7], 0);
    EXPECT_EQ(host.ask("141#9B00000000000000").data[7], 0);
  }
}

TEST(Generation, TargetsCoverTheOutputTurn) {
  const auto moved_to = [](const char* text) {
    Host host(mg4005(Generation::kV236, 90));
    send(host, text, 3s);
    EXPECT_EQ(host.bus.servo(1).stats.invalid_targets, 0U);
    return static_cast<double>(host.multi_turn_cdeg());
  };
  EXPECT_NEAR(moved_to("141#A500000020BF0200"), 180000, 10);  // clockwise to 1800°
  EXPECT_NEAR(moved_to("141#A501000030570500"), -10000, 10);  // back through 0 to 3500°
  Host host(mg4005(Generation::kV236, 90));
  host.ask("141#A5000000407E0500");  // 360000: out of range
  EXPECT_EQ(host.bus.servo(1).stats.invalid_targets, 1U);
  Host rotor(drive(Generation::kV236));
  rotor.ask("141#A5000000A08C0000");  // 36000
  EXPECT_EQ(rotor.bus.servo(1).stats.invalid_targets, 1U);
  rotor.ask("141#A50000009F8C0100");  // 35999 plus a bit above the lower 16
  EXPECT_EQ(rotor.bus.servo(1).stats.invalid_targets, 2U);
}

TEST(Generation, ClearAngleSetsTheAngleWithoutMotion) {
  Host host(drive(Generation::kV236));
  send(host, "141#A300000028230000", 1s);  // 90°
  const double before_deg = truth_deg(host);
  EXPECT_EQ(host.ask("141#95123456D5860100"), frame("141#95123456D5860100"));  // 1000.53°
  EXPECT_EQ(host.multi_turn_cdeg(), 100053);
  EXPECT_NEAR(host.single_turn_cdeg(), 9000, 4);  // affects only the multi-turn angle
  host.wait(1s);
  EXPECT_NEAR(truth_deg(host), before_deg, 360.0 / 16384);
  send(host, "141#A700000010270000", 1s);  // another 100° from the last target
  EXPECT_NEAR(truth_deg(host), before_deg + 100, 0.05);
  send(host, "141#A3000000D5860100", 1s);  // back to the present 1000.53°
  EXPECT_NEAR(truth_deg(host), before_deg, 0.05);
  host.bus.power_cycle(1);  // it is stored in RAM
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 9000, 4);
}

// --- run and speed

TEST(Generation, RunAfterStopWaitsForACommand) {
  for (const Generation generation :
       {Generation::kLegacy, Generation::kLateLegacy, Generation::kV235, Generation::kV236}) {
    Host host(drive(generation));
    send(host, {"141#A100000064000000", "141#8100000000000000", "141#8800000000000000"}, 1ms);
    const bool resumes = generation == Generation::kLegacy || generation == Generation::kLateLegacy;
    EXPECT_EQ(host.bus.truth(1).i_q_ref != 0, resumes);
    EXPECT_EQ(host.run_state(), RunState::kRunning);
  }
}

TEST(Generation, SpeedCommandsHaveLimitsFromV236) {
  for (const Generation generation : {Generation::kV235, Generation::kV236}) {
    const bool limited = generation == Generation::kV236;
    auto config = drive(generation);
    config.rom.max_speed_dps = 360;
    Host host(config);
    host.ask("141#A2000A0010270000");  // 100 dps, 10 LSB = 0.16 A
    const double demand_A = most_A(host);
    if (limited) {
      EXPECT_NEAR(demand_A, 10 * kMgLsb_A, 1e-9);
    } else {
      EXPECT_GT(demand_A, 0.3);
    }
    send(host, "141#A2000000A0860100", 1s);  // 1000 dps, limit 0 = Max Torque Current
    EXPECT_NEAR(test::speed_dps(host), limited ? 360 : 1000, 20);
  }
}

TEST(Generation, FrameLimitDoesNotRaiseMaxTorqueCurrent) {
  auto config = drive(Generation::kV236);
  config.rom.max_torque_current_lsb = 50;
  Host host(config);
  host.ask("141#A200000840420F00");
  EXPECT_NEAR(most_A(host), 50 * kMgLsb_A, 1e-9);
}

// --- MS

TEST(Generation, MsDrivesHaveOpenLoopPower) {
  Host host(drive(Generation::kV236, Series::kMs));
  EXPECT_EQ(host.ask("141#A0000000FA000000"), frame("141#A019000000000008"));  // 250, state before
  host.wait(200ms);
  const auto state = host.state_2();
  EXPECT_NEAR(state.power_permille, 250, 2);
  EXPECT_EQ(state.iq_A, 0);
  EXPECT_GT(state.speed_dps, 100);
  send(host, "141#A0000000FF7F0000", 200ms);  // beyond 850
  EXPECT_NEAR(host.state_2().power_permille, 850, 2);
  send(host, {"141#8000000000000000", "141#A0000000FA000000"});
  EXPECT_EQ(host.bus.servo(1).stats.refused_motion, 1U);
}

TEST(Generation, MsDrivesHaveNoTorqueCommand) {
  auto config = drive(Generation::kLegacy, Series::kMs);
  config.rom.broadcast_mode = true;
  Host host(config);
  EXPECT_TRUE(host.talk(frame("280#6400640064006400")).empty());
  EXPECT_EQ(host.bus.stats().count(Drop::kUnknownCommand), 1U);
  EXPECT_EQ(host.bus.servo(1).stats.unknown_commands, 1U);
}

// --- brake

TEST(Generation, BrakeReplyShowsItsCoil) {
  Host host(drive(Generation::kV236));
  EXPECT_EQ(host.ask("141#8C10FFFFFFFFFFFF"), frame("141#8C00000000000000"));
  EXPECT_EQ(host.ask("141#8C01FFFFFFFFFFFF"), frame("141#8C01000000000000"));
  EXPECT_EQ(host.ask("141#8C10000000000000"), frame("141#8C01000000000000"));
  EXPECT_EQ(host.ask("141#8C02000000000000"), frame("141#8C01000000000000"));
  EXPECT_EQ(host.bus.servo(1).stats.invalid_targets, 1U);
  host.ask("141#8000000000000000");  // off releases the shaft, not the brake
  EXPECT_EQ(host.ask("141#8C10000000000000"), frame("141#8C01000000000000"));
  EXPECT_EQ(host.ask("141#8C00000000000000"), frame("141#8C00000000000000"));
  host.ask("141#8C01000000000000");
  host.bus.power_cycle(1);
  EXPECT_EQ(host.ask("141#8C10000000000000"), frame("141#8C00000000000000"));
}

}  // namespace generation_test
}  // namespace lk::emulator
