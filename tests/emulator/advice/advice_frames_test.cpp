// Advice from single frames, or from the rate of frames.

#include <gtest/gtest.h>

#include <vector>

#include "tests/emulator/advice/advice_support.hpp"
#include "tests/support/faults.hpp"

namespace lk::emulator {
namespace advice_frames_test {

using protocol::PidGains;

TEST(AdviceRom, ReportsTheRemainingLife) {
  AdvisedHost host(test::servo_config(1));
  const auto write = query(protocol::WritePidToRom{PidGains{.angle_kp = 7}});
  host.receive(9, 0ns, 36s, write);
  EXPECT_EQ(host.count(AdviceKind::kRomWear), 0U) << "nine are not many";
  host.receive(9 * 36s, write);
  ASSERT_GT(host.count(AdviceKind::kRomWear), 0U);
  // One write in 36 s, and a memory rated for 10,000 writes: 100 h.
  EXPECT_NEAR(host.get(AdviceKind::kRomWear).found.numbers[2], 100, 1e-6);
  host.receive(10 * 36s, write);
  const Advice advice = host.get(AdviceKind::kRomWear);
  EXPECT_EQ(advice.count, 2U);
  EXPECT_EQ(advice.first, 9 * 36s);
  EXPECT_EQ(advice.found.numbers[0], 11) << "the numbers are the last ones";
  EXPECT_EQ(host.adviser.advice().size(), 1U);
}

TEST(AdviceRom, IgnoresOccasionalWrites) {
  AdvisedHost host(test::servo_config(1));
  // 10,000 writes in more than 365 days: 3153.6 s each.
  host.receive(30, 0ns, 3154s, query(protocol::WriteOffsetToRom{100}));
  EXPECT_EQ(host.all(), "");
  // Writes to RAM cause no wear.
  host.receive(30, 100'000s, 1s, query(protocol::WritePidToRam{PidGains{.angle_kp = 7}}));
  EXPECT_EQ(host.all(), "");
  host.receive(10, 200'000s, 3153s, query(protocol::WriteZeroToRom{}));
  EXPECT_EQ(host.count(AdviceKind::kRomWear), 1U);
}

TEST(AdviceLength, ChecksOnlyFramesForDrives) {
  AdvisedHost host(test::servo_config(1));
  host.receive(1ms, "7FF#01");  // not for a drive
  host.receive(2ms, "142#9A");  // no such drive
  host.receive(3ms, "141#9A00000000000000");
  EXPECT_EQ(host.all(), "");
  host.receive(4ms, "141#9A");
  EXPECT_NE(host.all().find("(1 time, first 141#9A at 0.004 s)"), std::string::npos) << host.all();
  host.receive(5ms, "141#9C00");
  ASSERT_EQ(host.count(AdviceKind::kWrongLength), 2U);
  const Advice advice = host.get(AdviceKind::kWrongLength);
  EXPECT_EQ(advice.first, 4ms);
  EXPECT_EQ(advice_line("vcan0", advice, Language::kEnglish),
            "vcan0:1: wrong-length: 1 of 8 bytes: the drive does not answer (2 times, "
            "first 141#9A at 0.004 s): give each frame the length of its command: 8 bytes on CAN, "
            "unused ones 0");
  EXPECT_EQ(advice_line("vcan0", advice, Language::kChinese),
            "vcan0:1: wrong-length: 1 个字节，应为 8 个：驱动器不回复（2 次，首次 141#9A，0.004 "
            "s）：每帧的长度要与命令相符：CAN 上都是 8 个字节，不用的字节填 0");
  EXPECT_EQ(host.adviser.mark_of(host.adviser.query_count()), "wrong-length");
  EXPECT_EQ(host.adviser.mark_of(3), "");
}

/// Each of the frames is out of range; `right`, given before, is not.
void expect_out_of_range(AdvisedHost& host, const std::vector<const char*>& right,
                         const std::vector<const char*>& wrong) {
  for (const char* frame : right) host.receive(1ms, frame);
  EXPECT_EQ(host.all(), "");
  std::uint64_t count = 0;
  for (const char* frame : wrong) {
    host.receive(6ms, frame);
    EXPECT_EQ(host.count(AdviceKind::kFieldRange), ++count) << frame;
  }
}

TEST(AdviceField, AcceptsTheLastValueOfTheRange) {
  AdvisedHost host(test::servo_config(1));
  expect_out_of_range(host,
                      {"141#A1000000D0070000",  // 2000
                       "141#A100000030F80000",  // -2000
                       "141#A50100009F8C0000",  // 359.99 deg
                       "141#34000000FFFFFF7F",
                       "141#9200000000000000",   // the host knows the angle
                       "141#A3000000FFFFFF7F"},  // Max Angle is off
                      {"141#A1000000D1070000", "141#A10000002FF80000", "141#A5000000A08C0000",
                       "141#A502000000000000", "141#3400000000000080", "141#910000000000FFFF"});
  EXPECT_EQ(host.what(AdviceKind::kFieldRange),
            "iq 2001 is beyond -2000 to 2000: the drive takes the nearest of them");
}

TEST(AdviceField, KnowsTheRangesOfV236) {
  AdvisedHost host(test::drive(Generation::kV236));
  expect_out_of_range(host,
                      {"141#A100000000080000",   // 2048
                       "141#A200000880380100",   // iq limit 2048, 800 dps
                       "141#C120000064000000"},  // Max Speed 1 dps
                      {"141#A100000001080000", "141#A200010800000000", "141#8C02000000000000",
                       "141#C120000063000000", "141#A200000000000070"});
}

TEST(AdviceGeneration, RecognisesFieldsOfAnotherGeneration) {
  ServoConfig geared = test::servo_config(1);
  geared.profile.drive.mechanics.gear_ratio = 10;
  AdvisedHost host(geared);
  // 0xA6 to 98,765 * 0.01 deg, which is below ten turns of the rotor but needs 32 bits: 0x181CD.
  host.receive(1ms, "141#A6006400CD810100");
  ASSERT_EQ(host.count(AdviceKind::kOtherGeneration), 1U);
  EXPECT_EQ(host.what(AdviceKind::kOtherGeneration),
            "a target of 32 bits, 987.65°: this drive reads 16 bits of it, 332.29°");
  host.receive(2ms, "141#9500000028230000");  // 90 deg
  EXPECT_EQ(host.count(AdviceKind::kOtherGeneration), 2U);
  host.receive(3ms, "141#A60064009F860100");  // 0x1869F: 999.99 deg, 344.63 in 16 bits
  host.receive(4ms, "141#A6006400F0EA0100");  // 0x1EAF0: 1256.96 deg, 601.44: out of range as well
  EXPECT_EQ(host.count(AdviceKind::kOtherGeneration), 4U);
  EXPECT_EQ(host.count(AdviceKind::kFieldRange), 0U) << host.all();
}

TEST(AdviceGeneration, RecognisesTheIqLimitOf0xA2) {
  AdvisedHost host(test::servo_config(1));
  host.receive(9, 0ns, 10ms, test::frame("141#A200F40110270000"));
  EXPECT_EQ(host.all(), "");
  host.receive(90ms, "141#A200F40110270000");
  EXPECT_EQ(host.count(AdviceKind::kOtherGeneration), 1U);
}

TEST(AdviceGeneration, IgnoresUnusedBytes) {
  AdvisedHost host(test::servo_config(1));
  for (int n = 0; n < 40; ++n) {
    const SimTime at = n * 10ms;
    host.receive(at + 1ms, "141#A50000001027CDAB");  // garbage after the target
    host.receive(at + 2ms, "141#95000000CCCCCCCC");
    host.receive(at + 3ms, "141#9500000000000000");
    host.receive(at + 4ms, "141#A200CDAB10270000");  // -21555 means no limit
  }
  EXPECT_EQ(host.count(AdviceKind::kOtherGeneration), 0U) << host.all();
}

/// Once is enough, since a host may query once and then give up or wait for ever.
TEST(AdviceUnknown, ReportsEachCommandAtOnce) {
  AdvisedHost host(test::drive(Generation::kV235));
  host.receive(1ms, "141#3000000000000000");
  host.receive(2ms, "141#3300000000000000");
  host.receive(3ms, "141#EE00000000000000");
  host.receive(4ms, "141#EE00000000000000");
  ASSERT_EQ(host.adviser.advice().size(), 3U) << host.all();
  EXPECT_EQ(advice_line("vcan0", host.adviser.advice()[0], Language::kEnglish),
            "vcan0:1: unknown-command: 0x30, read PID: no answer, this drive does not have the "
            "command; it is one of legacy, late-legacy (1 time, first 141#3000000000000000 at "
            "0.001 s): if the real drive has it, set pid_commands = true in its quirks, or choose "
            "a generation that has it; if not, do without");
  EXPECT_NE(what_text(host.adviser.advice()[1], Language::kEnglish).find("0x33"),
            std::string::npos);
  EXPECT_EQ(host.adviser.advice()[2].count, 2U);
  EXPECT_EQ(what_text(host.adviser.advice()[2], Language::kEnglish),
            "0xEE: no answer, no generation has the command");
  for (const Advice& advice : host.adviser.advice()) {
    EXPECT_EQ(advice_line("", advice, Language::kChinese).find('{'), std::string::npos);
  }
}

/// Queries of hosts for MyActuator drives from V3 on (protocol V4.2), which LK-TECH drives lack.
/// There 0x42 reads one of four accelerations; here it has the tables 05, A0, A4 and A8.
TEST(AdviceUnknown, ReportsAMyActuatorHostOnce) {
  for (const Generation generation : {Generation::kLegacy, Generation::kV236, Generation::kV236b}) {
    AdvisedHost host(test::drive(generation));
    int n = 0;
    for (const char* const data : {"B2", "B5", "60", "61", "62", "63", "64", "70", "71", "42"}) {
      host.receive(++n * 1ms, test::frame("141#" + std::string(data) + "00000000000000"));
    }
    ASSERT_EQ(host.adviser.advice().size(), 1U) << host.all();
    EXPECT_EQ(host.adviser.advice()[0].count, 10U);
    EXPECT_EQ(host.what(AdviceKind::kUnknownCommand),
              "no answer, LK-TECH drives do not have this command; MyActuator drives from V3 on "
              "do, but are not emulated");
    host.receive(20ms, "141#EE00000000000000");
    EXPECT_EQ(host.adviser.advice().size(), 2U);
  }
}

TEST(AdviceUnknown, SaysWhatTheDriveLacks) {
  const struct {
    Generation generation;
    Series series;
    const char* frame;
    const char* what;
  } cases[] = {
      {Generation::kLegacy, Series::kMg, "141#42050A0009000000",  // a setting of LK-TECH
       "0x42, write setting: no answer, this drive does not have the command; it is one of v236b"},
      {Generation::kV236, Series::kMg, "141#C077000000000000",
       "0xC0, read parameter: no answer, unknown parameter 119"},
      {Generation::kV236, Series::kMs, "141#A100000000000000",
       "0xA1, torque: no answer, drives of this series do not have the command"},
  };
  for (const auto& [generation, series, frame, what] : cases) {
    AdvisedHost host(test::drive(generation, series));
    host.receive(1ms, frame);
    ASSERT_EQ(host.adviser.advice().size(), 1U);
    EXPECT_EQ(host.what(AdviceKind::kUnknownCommand), what);
  }
}

/// One kind with two causes: each has its own text.
TEST(AdviceGeneration, ReportsEachCause) {
  AdvisedHost host(test::servo_config(1));
  host.receive(1ms, "141#9500000028230000");  // 90 deg
  for (int n = 0; n < 3; ++n) host.receive(2ms, "141#8C10000000000000");
  host.receive(3ms, "141#A500000078790100");  // 966.32 deg: beyond the widest circle
  ASSERT_EQ(host.adviser.advice().size(), 2U) << host.all();
  EXPECT_EQ(what_text(host.adviser.advice()[0], Language::kEnglish),
            "0x95 with the angle 90°: this drive ignores it, only v236 sets its angle so");
  EXPECT_EQ(host.adviser.advice()[0].count, 1U);
  EXPECT_EQ(
      what_text(host.adviser.advice()[1], Language::kEnglish),
      "0x8C, brake: no answer, this drive does not have the command; it is one of v236, v236b");
  EXPECT_EQ(host.adviser.advice()[1].count, 3U);
}

TEST(AdviceMulti, ReportsDrivesNotInBroadcastMode) {
  BusConfig config = test::bus_config({1, 2}, 1'000'000);
  AdvisedHost none(config);
  none.receive(1ms, "280#0000000000000000");
  EXPECT_EQ(none.count(AdviceKind::kMultiWithoutMode, kWholeBus), 1U);

  config.servos[0].rom.broadcast_mode = true;
  AdvisedHost one(config);
  one.receive(1ms, "280#6400000000000000");
  EXPECT_EQ(one.all(), "") << "nothing for drive 2";
  one.receive(2ms, "280#6400640000000000");
  EXPECT_EQ(one.count(AdviceKind::kMultiWithoutMode, 2), 1U);
  EXPECT_EQ(one.count(AdviceKind::kMultiWithoutMode, 1), 0U);
}

TEST(AdviceMulti, FollowsModeChangesByOthers) {
  AdvisedHost host(test::bus_config({1, 2}, 1'000'000));
  host.wait(100ms);
  Registers switched;
  switched.broadcast_mode = true;
  for (const int id : {1, 2}) {
    host.bus.apply({id, Setting{RomParameter::kBroadcastMode, switched}});
  }
  host.wait(100ms);
  host.repeat(20, 1ms, "280#6400640000000000");
  EXPECT_EQ(host.all(), "");
}

/// CANopen uses this identifier too, so a single frame proves nothing.
TEST(AdviceMulti, ReportsOtherGenerationForUnknownIdentifiers) {
  AdvisedHost host(test::bus_config({1, 2}, 1'000'000));
  host.receive(1ms, "281#6400000000000000");
  host.receive(2ms, "282#6400000000000000");
  EXPECT_EQ(host.all(), "");
  host.receive(3ms, "288#9C00000000000000");
  EXPECT_EQ(host.count(AdviceKind::kOtherGeneration, kWholeBus), 1U);
  EXPECT_EQ(host.count(AdviceKind::kMultiWithoutMode, kWholeBus), 0U) << "the mode would not help";
}

TEST(AdviceField, KnowsTheSlotsOfMultiDriveFrames) {
  BusConfig config = test::bus_config({1, 2}, 1'000'000);
  for (ServoConfig& servo : config.servos) {
    servo.generation = Generation::kV236;
    servo.quirks = quirks_of(servo.generation);
    servo.rom.broadcast_mode = true;
  }
  config.servos[0].rom.max_speed_dps = 1000;
  config.servos[0].rom.max_angle_deg = 90;
  AdvisedHost host(config);
  host.receive(1ms, "281#E803E80300000000");  // 1000 dps
  host.receive(2ms, "282#2823204E00000000");  // 90°, and 200° of drive 2
  EXPECT_EQ(host.all(), "");
  host.receive(3ms, "281#E903000000000000");
  EXPECT_EQ(host.count(AdviceKind::kFieldRange, 1), 1U);
  host.receive(4ms, "282#74DC000000000000");  // -91°
  EXPECT_EQ(host.count(AdviceKind::kFieldRange, 1), 2U);
  EXPECT_EQ(host.count(AdviceKind::kFieldRange, 2), 0U);
}

TEST(AdviceMulti, ReportsSingleCommandsInBroadcastMode) {
  BusConfig config = test::bus_config({1, 2}, 1'000'000);
  config.servos[0].rom.broadcast_mode = true;
  AdvisedHost host(config);
  host.receive(9, 0ns, 1ms, test::frame("141#9C00000000000000"));
  host.receive(30, 10ms, 1ms, test::frame("142#9C00000000000000"));
  host.receive(9, 1100ms, 1ms, test::frame("141#9C00000000000000"));
  EXPECT_EQ(host.all(), "") << "it tries how the drive is answered, and some time later again";
  host.receive(1200ms, "141#9C00000000000000");
  host.receive(1201ms, "141#A100000000000000");
  EXPECT_EQ(host.count(AdviceKind::kSingleInMultiMode, 1), 2U);
  EXPECT_EQ(host.count(AdviceKind::kSingleInMultiMode, 2), 0U);
}

TEST(AdvicePace, WarnsOnQueriesFasterThanReplies) {
  AdvisedHost host(test::servo_config(1));
  // 2 * 111 bits at 1 Mbit/s plus the reply time of 100 µs: the first reply comes after 322 µs.
  host.receive(100, 0ns, 330us, query(protocol::ReadState2{}));
  EXPECT_EQ(host.all(), "");
  host.receive(20, 1s, 300us, query(protocol::ReadState2{}));
  EXPECT_EQ(host.all(), "") << "the first of them has waited";
  host.receive(1s + 20 * 300us, query(protocol::ReadState2{}));
  EXPECT_EQ(host.count(AdviceKind::kNotWaited), 1U);
}

TEST(AdvicePace, IgnoresShortBursts) {
  AdvisedHost host(test::servo_config(1));
  for (int n = 0; n < 100; ++n) {
    for (int k = 0; k < 6; ++k) host.receive(n * 10ms + k * 10us, query(protocol::ReadState2{}));
  }
  EXPECT_EQ(host.all(), "");
  AdvisedHost no_wire(test::servo_config(1), 0);
  no_wire.receive(100, 0ns, 1us, query(protocol::ReadState2{}));
  EXPECT_EQ(no_wire.all(), "") << "replies come at once";
  // The process or simulated time stood still: all frames of that time arrive at one instant.
  AdvisedHost stood(test::servo_config(1));
  for (int n = 0; n < 50; ++n) {
    stood.receive(1s, query(protocol::Position2{100, 45'00 + 50 * n}));
  }
  stood.receive(1s + 1ms, query(protocol::Position2{100, 45'00 + 50 * 50}));
  EXPECT_EQ(stood.all(), "");
}

TEST(AdviceInput, WarnsOnPausesNearTheTimeout) {
  ServoConfig servo = test::servo_config(1);
  auto& input = servo.rom.protections[static_cast<std::size_t>(model::Error::kLostInput)];
  input.threshold = 0.1;
  AdvisedHost off(servo);
  off.receive(10, 0ns, 90ms, query(protocol::ReadState2{}));
  EXPECT_EQ(off.all(), "") << "the protection is off";
  input.enabled = true;
  AdvisedHost host(servo);
  host.receive(20, 0ns, 79ms, query(protocol::ReadState2{}));
  host.receive(100s, query(protocol::ReadState2{}));  // the host paused
  EXPECT_EQ(host.all(), "");
  for (int n = 1; n <= 3; ++n) host.receive(100s + n * 81ms, query(protocol::ReadState2{}));
  EXPECT_EQ(host.count(AdviceKind::kInputWindow), 1U);
}

/// A host that scans all commands at all IDs.
TEST(Advice, IsBoundedAndCountsOmittedEntries) {
  BusConfig config = test::bus_config({}, 0);
  for (int id = 1; id <= protocol::kMaxId; ++id) config.servos.push_back(test::servo_config(id));
  AdvisedHost host(config);
  for (int id = 1; id <= protocol::kMaxId; ++id) {
    for (int command = 0; command < 256; ++command) {
      protocol::Frame frame{.id = 0x140U + static_cast<std::uint32_t>(id), .dlc = 8};
      frame.data[0] = static_cast<std::uint8_t>(command);
      host.send(frame);
    }
    host.wait(1ms);
  }
  const std::uint64_t unknown = host.bus.stats().count(Drop::kUnknownCommand);
  std::uint64_t listed = 0;
  for (int id = 1; id <= protocol::kMaxId; ++id)
    listed += host.count(AdviceKind::kUnknownCommand, id);
  EXPECT_GT(unknown, 4000U);
  EXPECT_LE(host.adviser.advice().size(), 1000U);
  EXPECT_GE(listed + host.adviser.left_out(), unknown);
}

TEST(AdvicePace, WarnsOnAnOverloadedWire) {
  BusConfig config = test::bus_config({1, 2, 3, 4}, 1'000'000);
  AdvisedHost host(config);
  for (int n = 0; n < 300;
       ++n) {  // all four at 1 kHz: 8 frames a ms, of which 1 Mbit/s has 7 or so
    for (int id = 1; id <= 4; ++id) {
      host.send(query(protocol::ReadState2{}, id));
      host.send(query(protocol::ReadMultiTurnAngle{}, id));
    }
    host.wait(1ms);
  }
  ASSERT_GT(host.count(AdviceKind::kFasterThanWire, kWholeBus), 0U);
  EXPECT_GT(host.get(AdviceKind::kFasterThanWire, kWholeBus).first, 100ms);

  // Frames that a fault delays, and frames that arrive together after time has slipped.
  for (const bool slips : {false, true}) {
    AnsweredHost held(config);
    if (!slips) {
      held.bus.apply({kWholeBus, SetFault{test::fault_of("write_stalls", {1.0, 2000.0})}});
    }
    for (int n = 0; n < 400; ++n) {  // 2 % of the wire's capacity
      if (slips && n % 100 == 0) {
        held.adviser.note_slip(held.bus.time());
        for (int k = 0; k < 1200; ++k) held.send(query(protocol::ReadState2{}, 1 + k % 4));
      }
      held.send(query(protocol::ReadState2{}, 1 + n % 4));
      held.wait(10ms);
    }
    for (int id = 1; id <= 4; ++id) EXPECT_EQ(held.count(AdviceKind::kPollsDead, id), 0U);
    EXPECT_EQ(held.count(AdviceKind::kFasterThanWire, kWholeBus), 0U) << held.all();
    EXPECT_EQ(held.count(AdviceKind::kFasterThanDrive), 0U) << held.all();
  }

  AdvisedHost calm(config);  // the same frames in 5 ms
  for (int n = 0; n < 100; ++n) {
    for (int id = 1; id <= 4; ++id) {
      calm.send(query(protocol::ReadState2{}, id));
      calm.send(query(protocol::ReadMultiTurnAngle{}, id));
    }
    calm.wait(5ms);
  }
  EXPECT_EQ(calm.all(), "");
}

TEST(AdvicePace, IgnoresQueuesCausedByABabblingDrive) {
  BusConfig config = test::bus_config({1, 2}, 1'000'000);
  AdvisedHost host(config);
  // A frame every 130 us, back to back, with the highest priority.
  const Fault fault = test::fault_of("babbling", {130, 0x010}, {2});
  ASSERT_TRUE(host.bus.apply({kWholeBus, SetFault{fault}}));
  host.repeat(500, 2ms, query(protocol::ReadState2{}));
  EXPECT_GT(host.bus.stats().frames_waiting, 64U);
  EXPECT_EQ(host.all(), "");
}

TEST(AdvicePace, WarnsOnQueriesDuringARomWrite) {
  ServoConfig servo = test::servo_config(1);
  servo.flash.write_time = 500ms;
  AdvisedHost host(servo);
  host.send(query(protocol::WriteOffsetToRom{5}));
  host.repeat(15, 2ms, query(protocol::ReadState2{}));
  EXPECT_EQ(host.all(), "") << "16 replies find room";
  host.repeat(3, 2ms, query(protocol::ReadState2{}));
  EXPECT_EQ(host.count(AdviceKind::kFasterThanDrive), 3U);
}

}  // namespace advice_frames_test
}  // namespace lk::emulator
