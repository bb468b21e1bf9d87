// Advice about settings over the bus, from frames alone: drives here need not know the commands.
// The replies are those of docs/reference/protocol.md.

#include <gtest/gtest.h>

#include "tests/emulator/advice/advice_support.hpp"

namespace lk::emulator {
namespace advice_setting_test {

using protocol::ReadState2;

const protocol::Frame kWriteId9 = test::frame("141#42050A0009000000");
const protocol::Frame kWriteSpeed = test::frame("141#4205E200407E0500");
const protocol::Frame kSave = test::frame("141#4405FA0000000000");
const protocol::Frame kSavedReply = test::frame("141#4405010000000000");
const protocol::Frame kRestart = test::frame("141#0700000000000000");

/// Sends a query and the drive's reply.
void say(AnsweredHost& host, const protocol::Frame& query, const protocol::Frame& reply) {
  host.repeat(1, 1ms, query);
  host.adviser.on_reply({host.bus.time(), reply});
  host.wait(1ms);
}
void restart(AnsweredHost& host) {
  host.repeat(1, 1ms, kRestart);
  host.bus.power_cycle(1);
  host.wait(100ms);
}

TEST(AdviceSettings, DetectMixedUpParameterTables) {
  AnsweredHost host(test::servo_config(1));
  for (const auto* good : {"141#42050A0009000000", "141#42A0640014000500", "141#C00A000000000000",
                           "141#C11E000000100000"}) {
    host.repeat(1, 1ms, test::frame(good));
  }
  EXPECT_EQ(host.count(AdviceKind::kParameterSpace), 0U);
  for (const auto* mixed : {"141#420A640014000500", "141#4220000040420F00", "141#C0050A0000000000",
                            "141#C196000000000000", "141#C0EA000000000000"}) {
    host.repeat(1, 1ms, test::frame(mixed));
  }
  EXPECT_EQ(host.count(AdviceKind::kParameterSpace), 5U);
}

TEST(AdviceSettings, ReportLossAtRestart) {
  AnsweredHost host(test::servo_config(1));
  say(host, kWriteSpeed, kWriteSpeed);
  EXPECT_EQ(host.count(AdviceKind::kSettingNotSaved), 0U);
  restart(host);
  EXPECT_EQ(host.count(AdviceKind::kSettingNotSaved), 1U);
  host.repeat(5, 1ms, query(ReadState2{}));
  EXPECT_EQ(host.count(AdviceKind::kSettingNotSaved), 1U);
}

TEST(AdviceSettings, ReportLossAtPowerCycle) {
  AnsweredHost host(test::servo_config(1));
  say(host, kWriteSpeed, kWriteSpeed);
  host.bus.power_cycle(1);
  host.wait(5ms);
  host.repeat(2, 2ms, query(ReadState2{}));
  EXPECT_EQ(host.count(AdviceKind::kSettingNotSaved), 1U);
}

TEST(AdviceSettings, IgnoreSavedAndRejectedWrites) {
  AnsweredHost host(test::servo_config(1));
  say(host, kWriteSpeed, kWriteSpeed);
  say(host, kSave, kSavedReply);
  restart(host);
  host.repeat(1, 1ms, kWriteSpeed);  // without a reply
  restart(host);
  EXPECT_EQ(host.count(AdviceKind::kSettingNotSaved), 0U);
}

/// A drive that executes these commands.
ServoConfig second_print() { return test::drive(Generation::kV236b); }

TEST(AdviceSettings, FollowADriveToItsNewId) {
  AnsweredHost host(second_print());
  for (const protocol::Frame& frame : {kWriteId9, kSave, kRestart}) host.repeat(1, 10ms, frame);
  ASSERT_EQ(host.bus.bus_address(1).id, 9);
  host.repeat(20, 10ms, query(ReadState2{}, 9));
  host.repeat(1, 10ms, "149#3000000000000000");
  EXPECT_EQ(host.count(AdviceKind::kUnknownCommand), 1U) << host.all();
}

TEST(AdviceCalibration, WarnsOnALoadedShaft) {
  for (const double load_Nm : {0.0, 0.03}) {
    ServoConfig servo = second_print();
    servo.profile.rating.torque_rated_Nm = 0.1;
    servo.profile.drive.load.tau = load_Nm;
    AnsweredHost host(servo);
    host.repeat(1, 5s, "141#1800000000000000");
    EXPECT_EQ(host.count(AdviceKind::kCalibrationUnderLoad), load_Nm > 0 ? 1U : 0U) << host.all();
  }
}

}  // namespace advice_setting_test
}  // namespace lk::emulator
