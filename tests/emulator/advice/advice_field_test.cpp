// Advice on problems of real robots, and none for correct hosts.

#include <gtest/gtest.h>

#include "tests/emulator/advice/advice_support.hpp"
#include "tests/support/faults.hpp"

namespace lk::emulator {
namespace advice_field_test {

using protocol::ClearErrors;
using protocol::Position1;
using protocol::ReadMultiTurnAngle;
using protocol::ReadState1;
using protocol::ReadState2;

// --- reply to 0x9B

/// A drive with a tripped lost-input error; 0x9B shows the errors that it clears.
AnsweredHost tripped(bool before = true) {
  ServoConfig servo = test::servo_config(1);
  servo.rom.protections[static_cast<std::size_t>(model::Error::kLostInput)] = {true, 0.1, 0, 0};
  AnsweredHost host(servo);
  if (before) host.bus.apply({kWholeBus, SetFault{test::fault_of("clear_reply_before", {}, {1})}});
  host.repeat(2, 1ms, query(ReadState2{}));
  host.wait(200ms);
  host.repeat(2, 1ms, query(ReadState2{}));
  return host;
}

void clear(AnsweredHost& host) {
  host.repeat(1, 50ms, query(ClearErrors{}));
  host.repeat(10, 50ms, query(ReadState2{}));
}

TEST(AdviceClear, WarnsOnRepeatedClears) {
  AnsweredHost host = tripped();
  clear(host);
  clear(host);
  EXPECT_EQ(host.count(AdviceKind::kTrustsClearReply), 0U);
  clear(host);
  EXPECT_EQ(host.count(AdviceKind::kTrustsClearReply), 1U);
  EXPECT_EQ(host.what(AdviceKind::kTrustsClearReply),
            "0x9B for the 3. time within 1.1 s: the first has cleared the errors, its reply shows "
            "those from before");
}

TEST(AdviceClear, WarnsWhenTheDriveAlwaysRepliesWithOldErrors) {
  ServoConfig servo = test::servo_config(1);
  servo.quirks.clear_reply = ClearReply::kBefore;
  servo.rom.protections[static_cast<std::size_t>(model::Error::kLostInput)] = {true, 0.1, 0, 0};
  AnsweredHost host(servo);
  host.repeat(2, 1ms, query(ReadState2{}));
  host.wait(200ms);
  host.repeat(2, 1ms, query(ReadState2{}));
  for (int n = 0; n < 3; ++n) clear(host);
  EXPECT_EQ(host.count(AdviceKind::kTrustsClearReply), 1U);
}

TEST(AdviceClear, IgnoresHostThatReadsTheState) {
  AnsweredHost host = tripped();
  for (int n = 0; n < 5; ++n) {
    clear(host);
    host.repeat(1, 10ms, query(ReadState1{}));
  }
  EXPECT_EQ(host.all(), "");
}

TEST(AdviceClear, IgnoresCurrentRepliesAndNewErrors) {
  AnsweredHost host = tripped(false);
  for (int n = 0; n < 5; ++n) clear(host);
  EXPECT_EQ(host.count(AdviceKind::kTrustsClearReply), 0U);
  AnsweredHost again = tripped();
  for (int n = 0; n < 5; ++n) {
    clear(again);
    again.wait(200ms);  // trips again
    again.repeat(1, 2ms, query(ReadState2{}));
  }
  EXPECT_EQ(again.count(AdviceKind::kTrustsClearReply), 0U);
}

TEST(AdviceClear, IgnoresOccasionalClears) {
  AnsweredHost host = tripped();
  for (int n = 0; n < 5; ++n) {
    clear(host);
    host.repeat(60, 50ms, query(ReadState2{}));
  }
  EXPECT_EQ(host.count(AdviceKind::kTrustsClearReply), 0U);
}

// --- drives that do not answer

void poll(AnsweredHost& host, int id, int times, SimTime gap) {
  for (int n = 0; n < times; ++n) {
    host.repeat(1, gap / 2, query(ReadState2{}));
    host.repeat(1, gap / 2, query(ReadState2{}, id));
  }
}

TEST(AdvicePolls, WarnsOnFullRatePollsOfAMissingId) {
  AnsweredHost host(test::servo_config(1));
  poll(host, 7, 90, 20ms);
  EXPECT_EQ(host.all(), "");
  poll(host, 7, 20, 20ms);
  EXPECT_GT(host.count(AdviceKind::kPollsDead, 7), 0U);
  EXPECT_EQ(host.count(AdviceKind::kPollsDead, 1), 0U);
}

TEST(AdvicePolls, WarnsOnPollsOfAnUnpoweredDrive) {
  AnsweredHost host(test::powered_bus({1, 2}));
  host.bus.apply({2, PowerOff{}});
  host.wait(5s);
  poll(host, 2, 110, 20ms);
  EXPECT_GT(host.count(AdviceKind::kPollsDead, 2), 0U);
}

TEST(AdvicePolls, IgnoresHostThatBacksOff) {
  AnsweredHost host(test::servo_config(1));
  poll(host, 7, 15, 20ms);
  for (int n = 0; n < 60; ++n) {
    host.repeat(50, 20ms, query(ReadState2{}));
    host.repeat(1, 1ms, query(ReadState2{}, 7));
  }
  EXPECT_EQ(host.all(), "");
}

TEST(AdvicePolls, IgnoresHostThatPollsOneMissingDriveOnly) {
  AnsweredHost host(test::servo_config(1));
  host.repeat(500, 20ms, query(ReadState2{}, 7));
  EXPECT_EQ(host.all(), "");
}

/// Another program owns that drive: its replies have the identifier of the queries.
TEST(AdvicePolls, IgnoresDriveOfAnotherProgram) {
  AnsweredHost host(test::servo_config(1));
  for (int n = 0; n < 500; ++n) {
    host.repeat(1, 5ms, query(ReadState2{}));
    host.send(query(ReadState2{}, 7));
    host.repeat(1, 1ms, query(ReadState2{}));  // before the other host reads the reply
    host.repeat(1, 5ms, "147#9C19000000000008");
  }
  EXPECT_EQ(host.count(AdviceKind::kPollsDead, 7), 0U);
}

// --- latency of the adapter

AnsweredHost behind_ch348() {
  BusConfig config = test::bus_config({1}, 1'000'000);
  config.adapter = find_adapter("ch348");
  return AnsweredHost(config);
}

/// A reply takes 0.34 ms on the wire and 0.54 ms in the adapter.
TEST(AdviceTimeout, WarnsWhenQueriesOvertakeReplies) {
  AnsweredHost host = behind_ch348();
  host.repeat(5, 600us, query(ReadState2{}));
  EXPECT_EQ(host.all(), "");
  host.repeat(20, 600us, query(ReadState2{}));
  EXPECT_GT(host.count(AdviceKind::kTimeoutBelowLatency), 0U);
}

TEST(AdviceTimeout, IgnoresHostThatWaitsLongEnough) {
  AnsweredHost host = behind_ch348();
  host.repeat(500, 2ms, query(ReadState2{}));
  EXPECT_EQ(host.all(), "");
}

TEST(AdviceTimeout, IgnoresLostReplies) {
  AnsweredHost host = behind_ch348();
  host.bus.apply({kWholeBus, SetFault{test::fault_of("silent", {}, {1})}});
  host.repeat(100, 2ms, query(ReadState2{}));
  host.bus.apply({kWholeBus, ClearFault{"all"}});
  host.wait(20ms);
  host.repeat(100, 2ms, query(ReadState2{}));
  EXPECT_EQ(host.count(AdviceKind::kTimeoutBelowLatency), 0U) << host.all();
}

TEST(AdviceTimeout, IgnoresBusWithoutAdapter) {
  AnsweredHost host(test::servo_config(1));
  host.repeat(100, 600us, query(ReadState2{}));
  EXPECT_EQ(host.all(), "");
}

}  // namespace advice_field_test
}  // namespace lk::emulator
