// Advice on the motions that a host commands.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/emulator/advice/advice_support.hpp"

namespace lk::emulator {
namespace advice_motion_test {

using protocol::Position1;
using protocol::Position2;
using protocol::Position5;
using protocol::ReadMultiTurnAngle;
using protocol::ReadState1;
using protocol::ReadState2;

std::int32_t cdeg(double deg) { return static_cast<std::int32_t>(std::lround(100 * deg)); }
protocol::Frame speed(double dps) { return query(protocol::Speed{dps, 0}); }

// --- commands while off or with an error

/// A drive that 0x80 switches off until 0x88.
ServoConfig switchable() {
  ServoConfig servo = test::servo_config(1);
  servo.quirks.off_needs_run = true;
  return servo;
}

TEST(AdviceRefused, WarnsOnMotionWhileSwitchedOff) {
  AdvisedHost host(switchable());
  host.repeat(10, 2ms, query(protocol::Torque{0.1}));
  host.repeat(1, 2ms, query(protocol::Off{}));
  host.repeat(3, 2ms, query(protocol::Torque{0.1}));  // by a thread that does not yet know
  host.repeat(60, 2ms, query(ReadState2{}));
  EXPECT_EQ(host.all(), "");
  host.repeat(3, 2ms, query(Position2{100, cdeg(90)}));
  ASSERT_EQ(host.count(AdviceKind::kMotionRefused), 3U);
  EXPECT_EQ(host.get(AdviceKind::kMotionRefused).frame, query(Position2{100, cdeg(90)}));
  EXPECT_EQ(host.what(AdviceKind::kMotionRefused),
            "the drive is off: the command is answered and not executed");
  EXPECT_EQ(todo_text(host.get(AdviceKind::kMotionRefused), Language::kEnglish),
            "switch the drive on with 0x88, then move")
      << "there is no error";
  host.repeat(1, 2ms, query(protocol::Run{}));
  host.repeat(3, 2ms, query(Position2{100, cdeg(90)}));
  EXPECT_EQ(host.count(AdviceKind::kMotionRefused), 3U);
}

/// For any time of the command between two looks, and any reply time: the command before 0x80 was
/// executed.
TEST(AdviceRefused, NamesTheRefusedFrame) {
  ServoConfig slow = switchable();
  slow.reply_time = 400us;
  for (int part = 0; part < 32; ++part) {
    for (const std::int64_t bitrate : {0, 250'000, 1'000'000}) {
      AdvisedHost host(slow, bitrate);
      host.wait(10ms + part * (1ms / 32));
      host.repeat(1, 3ms, query(protocol::Torque{0.1}));
      host.repeat(1, 150ms, query(protocol::Off{}));
      const protocol::Frame refused = query(protocol::Torque{0.2});
      host.repeat(2, 10ms, refused);
      ASSERT_EQ(host.count(AdviceKind::kMotionRefused), 2U) << part << ", " << bitrate;
      EXPECT_EQ(host.get(AdviceKind::kMotionRefused).frame, refused) << part << ", " << bitrate;
    }
  }
}

/// Off, on and off again within one look, behind a queue of other frames.
TEST(AdviceRefused, SeparatesCommandsBeforeAndAfterRun) {
  for (int part = 0; part < 32; ++part) {
    AdvisedHost host(switchable(), 250'000);
    host.send(query(protocol::Off{}));
    host.wait(150ms + part * (1ms / 32));
    for (int n = 0; n < 3; ++n) host.send(query(ReadState2{}));
    const protocol::Frame refused = query(protocol::Torque{0.2});
    host.send(refused);
    host.send(query(protocol::Run{}));
    host.send(query(protocol::Torque{0.3}));
    host.wait(20ms);
    ASSERT_EQ(host.count(AdviceKind::kMotionRefused), 1U) << part;
    EXPECT_EQ(host.get(AdviceKind::kMotionRefused).frame, refused) << part;
  }
}

/// A drive that trips on under-voltage as soon as its supply is at 5 V.
ServoConfig delicate() {
  ServoConfig servo = test::servo_config(1);
  servo.rom.protections[static_cast<std::size_t>(model::Error::kUnderVoltage)] = {
      .enabled = true, .threshold = 8, .hysteresis = 0.5, .delay = 0, .recoverable = true};
  return servo;
}

AdvisedHost tripped() {
  AdvisedHost host(delicate());
  host.repeat(5, 2ms, query(protocol::Torque{0.1}));
  host.bus.set_supply_voltage(1, 5);
  host.repeat(200, 2ms, query(ReadState2{}));
  EXPECT_NE(host.bus.telemetry(1).errors, 0);
  return host;
}

TEST(AdviceRefused, GivesAHostTimeToSeeTheError) {
  AdvisedHost host = tripped();
  host.repeat(20, 2ms, query(protocol::Torque{0.1}));
  EXPECT_EQ(host.all(), "") << "it cannot know";
  host.repeat(1, 2ms, query(ReadState1{}));
  host.repeat(40, 2ms, query(protocol::Torque{0.1}));
  EXPECT_EQ(host.all(), "") << "it is about to react";
  host.repeat(20, 2ms, query(protocol::Torque{0.1}));
  EXPECT_GT(host.count(AdviceKind::kMotionRefused), 5U);
}

TEST(AdviceRefused, IgnoresHostThatRecovers) {
  AdvisedHost host = tripped();
  host.repeat(20, 2ms, query(protocol::Torque{0.1}));
  host.repeat(1, 2ms, query(ReadState1{}));
  host.bus.set_supply_voltage(1, 24);
  host.wait(500ms);
  host.repeat(1, 2ms, query(protocol::ClearErrors{}));
  host.repeat(1, 2ms, query(protocol::Torque{0.1}));  // from another thread
  host.repeat(1, 2ms, query(protocol::Run{}));
  host.repeat(100, 2ms, query(protocol::Torque{0.1}));
  EXPECT_EQ(host.all(), "");
}

TEST(AdviceError, WarnsHostThatNeverReadsErrors) {
  AdvisedHost host = tripped();
  host.repeat(1000, 2ms, query(ReadState2{}));
  ASSERT_GT(host.count(AdviceKind::kErrorIgnored), 0U);
  EXPECT_EQ(host.get(AdviceKind::kErrorIgnored).found.numbers[0], 1) << "under-voltage is bit 0";

  AdvisedHost asks = tripped();
  for (int n = 0; n < 10; ++n) {
    asks.repeat(100, 2ms, query(ReadState2{}));
    asks.repeat(1, 2ms, query(ReadState1{}));
  }
  EXPECT_EQ(asks.all(), "");
}

/// A host that commands at 100 Hz for `duration`; the drive trips at the end.
AdvisedHost tripped_after(SimTime duration) {
  AdvisedHost host(delicate());
  host.repeat(static_cast<int>(duration / 10ms), 10ms, query(protocol::Torque{0.1}));
  host.bus.set_supply_voltage(1, 5);
  return host;
}

TEST(AdviceError, WarnsHostThatStopsSending) {
  AdvisedHost host = tripped_after(2500ms);
  host.repeat(20, 10ms, query(ReadState2{}));
  ASSERT_NE(host.bus.telemetry(1).errors, 0);
  host.wait(4900ms);
  EXPECT_EQ(host.all(), "") << "it may be thinking";
  host.wait(200ms);
  ASSERT_EQ(host.count(AdviceKind::kErrorIgnored), 1U) << host.all();
  EXPECT_EQ(host.get(AdviceKind::kErrorIgnored).frame, query(ReadState2{})) << "its last";
  EXPECT_EQ(host.what(AdviceKind::kErrorIgnored),
            "the drive has an error (errorState 1), and the host, which had spoken to it until "
            "then, has been "
            "silent for 5 s without having asked for its state");
  host.wait(10s);
  EXPECT_EQ(host.count(AdviceKind::kErrorIgnored), 1U);
}

TEST(AdviceError, IgnoresHostThatReadTheErrorOrWasAbsent) {
  AdvisedHost asked = tripped_after(2500ms);
  asked.repeat(1, 10ms, query(ReadState2{}));
  asked.repeat(1, 10ms, query(ReadState1{}));
  asked.wait(10s);
  EXPECT_EQ(asked.all(), "") << "it has seen the error, and ends";

  AdvisedHost guest = tripped_after(1500ms);
  guest.repeat(20, 10ms, query(ReadState2{}));
  guest.wait(10s);
  EXPECT_EQ(guest.all(), "") << "it looked in for a moment";

  AdvisedHost slow(delicate());
  slow.repeat(4, 1500ms, query(ReadState2{}));
  slow.bus.set_supply_voltage(1, 5);
  slow.repeat(1, 1500ms, query(ReadState2{}));
  slow.wait(10s);
  EXPECT_EQ(slow.all(), "") << "its next query is yet to come";

  AdvisedHost regular(delicate());
  for (int n = 0; n < 3; ++n) {
    regular.repeat(1, 10ms, query(ReadState1{}));
    regular.repeat(90, 10ms, query(ReadState2{}));
  }
  regular.bus.set_supply_voltage(1, 5);
  regular.repeat(50, 10ms, query(ReadState2{}));
  regular.wait(10s);
  EXPECT_EQ(regular.all(), "") << "it ends before it would have asked again";

  AdvisedHost quick(delicate());
  quick.repeat(300, 10ms, query(ReadState1{}));
  quick.bus.set_supply_voltage(1, 5);
  quick.bus.advance_to(quick.bus.time() + 900us);  // before the adviser looks
  quick.repeat(1, 10ms, query(ReadState1{}));
  quick.wait(10s);
  EXPECT_EQ(quick.all(), "") << "the answer has shown the error";

  AdvisedHost gone = tripped_after(2500ms);
  gone.wait(10s);
  EXPECT_EQ(gone.all(), "") << "the error came when it had left";

  AdvisedHost healthy(test::servo_config(1));
  healthy.repeat(250, 10ms, query(ReadState2{}));
  healthy.wait(10s);
  EXPECT_EQ(healthy.all(), "") << "there is no error";
}

TEST(AdviceError, IgnoresUnpoweredDrive) {
  ServoConfig servo = delicate();
  servo.profile.drive.supply.i_logic = 0.05;  // A; empties the link
  AdvisedHost host(servo);
  host.repeat(300, 10ms, query(ReadState2{}));
  host.bus.apply({1, PowerOff{}});
  host.repeat(100, 10ms, query(ReadState2{}));
  host.repeat(30, 300ms, query(ReadState1{}));
  ASSERT_FALSE(host.bus.telemetry(1).alive);
  host.wait(10s);
  EXPECT_EQ(host.all(), "");
}

// --- paths

/// No-load speed of the tests' motor: 24 V / sqrt(3) over 14 pole pairs and 4.99 mWb.
const double kNoLoad_dps = 24 / std::sqrt(3.0) / (14 * 0.00499) * 180 / std::acos(-1.0);

TEST(AdviceJump, WarnsOnAStepFasterThanTheMotor) {
  ServoConfig servo = test::servo_config(1);
  AdvisedHost host(servo);
  double target_deg = 45;
  for (int n = 0; n < 100; ++n) {
    host.repeat(1, 2ms, query(Position1{cdeg(target_deg)}));
    target_deg += 0.5;
  }
  EXPECT_EQ(host.all(), "");
  const double most_deg = 1.5 * kNoLoad_dps * 0.002;
  host.repeat(1, 2ms, query(Position1{cdeg(target_deg + 1.1 * most_deg)}));
  ASSERT_EQ(host.count(AdviceKind::kJump), 1U);
  EXPECT_NEAR(host.get(AdviceKind::kJump).found.numbers[2], kNoLoad_dps, 1);
}

TEST(AdviceJump, IgnoresSingleTargetsAndLostFrames) {
  AdvisedHost host(test::servo_config(1));
  for (int n = 0; n < 10; ++n) {  // one target repeatedly, then another
    host.repeat(20, 2ms, query(Position1{cdeg(n % 2 == 0 ? 300 : -300)}));
  }
  for (int n = 0; n < 100; ++n) {  // a stream that loses a frame and then catches up
    const double target_deg = 45 + 8.0 * n;
    if (n % 10 != 0) host.send(query(Position1{cdeg(target_deg)}));
    host.wait(n % 10 == 1 ? 400us : n % 10 == 2 ? 3600us : 2ms);
  }
  EXPECT_EQ(host.count(AdviceKind::kJump), 0U) << host.all();
}

/// A knee of the delivered dog swings its foot: steps of 13.2° of the rotor every 10 ms, with a max
/// speed just above that. Host or machine is delayed; then targets arrive at the wire's rate for
/// twelve drives.
TEST(AdviceJump, IgnoresDelayedStreams) {
  for (const SimTime hold : {60ms, 100ms, 200ms, 500ms, 900ms}) {
    AdvisedHost host(test::servo_config(1));
    double target_deg = 45;
    const auto step = [&](SimTime gap) {
      target_deg += 13.2;
      host.repeat(1, gap, query(Position2{1572, cdeg(target_deg)}));
    };
    for (int n = 0; n < 50; ++n) step(10ms);
    step(hold);
    for (int n = 1; n < hold / 6800us; ++n) step(3200us);
    for (int n = 0; n < 50; ++n) step(10ms);
    EXPECT_EQ(host.count(AdviceKind::kJump), 0U) << hold.count();
    target_deg += 50;
    step(10ms);
    EXPECT_EQ(host.count(AdviceKind::kJump), 1U) << "it is still watched";
  }
}

TEST(AdviceWindUp, WarnsWhenTheShaftLagsBehind) {
  ServoConfig servo = test::servo_config(1);
  servo.rom.max_speed_dps = 50;
  AdvisedHost host(servo);
  host.repeat(99, 10ms, query(Position5{cdeg(10)}));  // 1000 dps
  EXPECT_EQ(host.count(AdviceKind::kWindUp), 0U);
  host.repeat(50, 10ms, query(Position5{cdeg(10)}));
  // In 1.5 s the host demanded 1500° of which 75° are possible: 1.4 s behind.
  EXPECT_GT(host.count(AdviceKind::kWindUp), 0U);
}

TEST(AdviceWindUp, IgnoresCompletedIncrements) {
  AdvisedHost host(test::servo_config(1));
  host.repeat(500, 10ms, query(Position5{cdeg(1)}));  // 100 dps
  for (int n = 0; n < 10; ++n) host.repeat(1, 600ms, query(Position5{cdeg(90)}));
  host.repeat(20, 1ms, query(Position5{cdeg(1)}));  // a fast turn of a jog wheel
  host.wait(2s);
  host.repeat(20, 1ms, query(Position5{cdeg(-1)}));
  EXPECT_EQ(host.all().find("wind-up"), std::string::npos) << host.all();
}

// --- positions sent as speeds

TEST(AdviceSpeed, WarnsOnAPathThatStartsAtTheShaftAngle) {
  AdvisedHost host(test::servo_config(1));  // at 45°
  host.repeat(1, 2ms, query(ReadMultiTurnAngle{}));
  for (int n = 0; n < 30; ++n) host.repeat(1, 10ms, speed(45 + 0.9 * n));
  EXPECT_GT(host.count(AdviceKind::kSpeedAsPosition), 0U);
}

TEST(AdviceSpeed, WarnsOnTargetsReplacedOnArrival) {
  AdvisedHost host(test::servo_config(1));
  for (const double target_deg : {90.0, 180.0, 270.0}) {
    for (int n = 0; n < 1000; ++n) {
      host.repeat(1, 5ms, speed(target_deg));
      if (host.bus.servo(1).multi_turn_deg(host.bus.telemetry(1)) > target_deg - 1) break;
    }
  }
  host.repeat(1, 5ms, speed(360));
  EXPECT_GT(host.count(AdviceKind::kSpeedAsPosition), 0U);
}

TEST(AdviceSpeed, IgnoresGenuineSpeeds) {
  AdvisedHost host(test::servo_config(1));
  host.repeat(1, 2ms, query(ReadMultiTurnAngle{}));
  for (int n = 0; n <= 100; ++n) host.repeat(1, 10ms, speed(n));  // a ramp from rest
  host.repeat(300, 10ms, speed(100));                             // a turntable
  for (const double dps : {50.0, -200.0, 35.0}) host.repeat(100, 10ms, speed(dps));
  for (int n = 0; n < 500; ++n) {  // a host with its own position loop, to 720°
    host.send(query(ReadMultiTurnAngle{}));
    host.wait(1ms);
    const double angle_deg = host.bus.servo(1).multi_turn_deg(host.bus.telemetry(1));
    host.repeat(1, 9ms, speed(5 * (720 - angle_deg)));
  }
  host.repeat(1, 10ms, speed(0));
  EXPECT_EQ(host.all(), "");
  AdvisedHost sweep(test::servo_config(1));  // reverses at ±90°, with 90 dps towards them
  double dps = 90;
  for (int n = 0; n < 2000; ++n) {
    sweep.repeat(1, 5ms, speed(dps));
    const double angle_deg = sweep.bus.servo(1).multi_turn_deg(sweep.bus.telemetry(1));
    if (angle_deg >= 90) dps = -90;
    if (angle_deg <= -90) dps = 90;
  }
  EXPECT_EQ(sweep.all(), "");
  // A drive at some angle that turns from there at an equal number of dps: once may be chance.
  AdvisedHost chance(test::servo_config(1));
  chance.repeat(1, 2ms, query(ReadMultiTurnAngle{}));
  chance.repeat(100, 10ms, speed(45));
  EXPECT_EQ(chance.all(), "");
}

// --- all advice together

TEST(Advice, IgnoresCorrectHost) {
  BusConfig config = test::bus_config({1, 2, 3, 4}, 1'000'000);
  AdvisedHost host(config);
  for (int id = 1; id <= 4; ++id) {  // set-up
    host.repeat(1, 5ms, query(protocol::WritePidToRom{{.angle_kp = 80}}, id));
    host.repeat(1, 1ms, query(protocol::ClearErrors{}, id));
    host.repeat(1, 1ms, query(protocol::Run{}, id));
    host.repeat(1, 1ms, query(ReadMultiTurnAngle{}, id));
  }
  for (int n = 0; n < 1000; ++n) {  // 200 Hz, a smooth path from the present angle
    for (int id = 1; id <= 4; ++id) {
      const double target_deg = 45 + 30 * (1 - std::cos(0.01 * n));
      host.repeat(1, 500us, query(Position2{2000, cdeg(target_deg)}, id));
      if (n % 50 == id) host.repeat(1, 500us, query(ReadState1{}, id));
    }
    host.wait(3ms);
  }
  for (int id = 1; id <= 4; ++id) host.repeat(1, 1ms, query(protocol::Off{}, id));
  EXPECT_EQ(host.all(), "");
}

}  // namespace advice_motion_test
}  // namespace lk::emulator
