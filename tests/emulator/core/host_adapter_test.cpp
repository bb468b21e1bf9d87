// The adapter between a host and its wire: timing, profiles, and a bus behind it.

#include "emulator/core/bus/host_adapter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/emulator/core/core_support.hpp"
#include "tests/support/faults.hpp"
#include "tests/support/serial_bus.hpp"

namespace lk::emulator {
namespace host_adapter_test {

using namespace std::chrono_literals;
using test::frame;
using test::run_until;

const protocol::Frame kAskSerial[] = {
    test::packet("3E 9C 01 00 DB"), test::packet("3E 9C 02 00 DC"), test::packet("3E 9C 03 00 DD")};

TimedFrame reply(SimTime at) { return {at, frame("141#9C19000000000000")}; }

std::vector<SimTime> arrivals(HostAdapter& adapter) {
  std::vector<SimTime> times;
  while (adapter.next_due()) times.push_back(adapter.take().at);
  return times;
}

AdapterTimes times_of(std::string_view profile) { return find_adapter(profile)->times; }

TEST(HostAdapter, SlcanCarries523FramesPerSecond) {
  constexpr double kFrame_s = 1 / 523.6;  // 22 characters of 10 bits at 115200 baud
  HostAdapter adapter(times_of("slcan_115200"), 1);
  SimTime last{0};
  for (int n = 0; n < 500; ++n) {
    last = adapter.to_wire(0s).at;
    adapter.from_wire(reply(0s));
  }
  EXPECT_NEAR(std::chrono::duration<double>(last).count(), 500 * kFrame_s, 0.001);
  const auto times = arrivals(adapter);
  EXPECT_NEAR(std::chrono::duration<double>(times.back()).count(), 500 * kFrame_s, 0.001);
  EXPECT_NEAR(std::chrono::duration<double>(times.front()).count(), 0.00191, 1e-5);
}

TEST(HostAdapter, BatchesArriveAtTicksInOrder) {
  HostAdapter adapter(times_of("usb_can"), 1);
  for (const SimTime at : {100us, 900us, 1000us, 1001us}) adapter.from_wire(reply(at));
  EXPECT_EQ(arrivals(adapter), (std::vector<SimTime>{1ms, 1ms, 1ms, 2ms}));
}

TEST(HostAdapter, FullBufferIsSentAtOnce) {
  HostAdapter adapter({.batch_us = 16'000, .batch_most = 3}, 1);
  for (const SimTime at : {100us, 200us, 300us}) adapter.from_wire(reply(at));
  EXPECT_EQ(arrivals(adapter), (std::vector<SimTime>{300us, 300us, 300us}));
  adapter.from_wire(reply(400us));
  EXPECT_EQ(arrivals(adapter), std::vector<SimTime>{16ms});
}

TEST(HostAdapter, DropsTheNewestAndReportsItOnce) {
  HostAdapter adapter({.batch_us = 1000, .depth = 2}, 1);
  EXPECT_FALSE(adapter.from_wire(reply(100us)).lost);
  EXPECT_FALSE(adapter.from_wire(reply(200us)).lost);
  const AdapterEffects third = adapter.from_wire(reply(300us));
  EXPECT_TRUE(third.lost && third.reported);
  const AdapterEffects fourth = adapter.from_wire(reply(400us));
  EXPECT_TRUE(fourth.lost && !fourth.reported);
  EXPECT_EQ(arrivals(adapter), (std::vector<SimTime>{1ms, 1ms}));
  EXPECT_FALSE(adapter.from_wire(reply(1100us)).lost);
}

TEST(HostAdapter, QueueIsLimitedWithoutADepth) {
  HostAdapter adapter({.rx_us = 1e6}, 1);
  for (int n = 0; n < 5000; ++n) adapter.from_wire(reply(0s));
  EXPECT_EQ(arrivals(adapter).size(), kMaxInAdapter);
}

TEST(HostAdapter, WritesStallOnlyWithoutReplies) {
  HostAdapter adapter({.stall_every = 2, .stall_us = 5.2e6}, 1);
  SimTime now = 1s;
  std::vector<SimTime> blocked;
  for (int n = 0; n < 4; ++n) {
    const SimTime written = adapter.to_wire(now).at;
    blocked.push_back(written - now);
    now = written + 20ms;  // time-out of the host
  }
  EXPECT_EQ(blocked, (std::vector<SimTime>{0s, 5200ms, 0s, 5200ms}));
  for (int n = 0; n < 4; ++n) {  // replies arrive
    EXPECT_EQ(adapter.to_wire(now).at, now);
    adapter.from_wire(reply(now + 1ms));
    now += 20ms;
  }
}

TEST(HostAdapter, WritesDuringAStallWaitForItsEnd) {
  HostAdapter adapter({.stall_every = 1, .stall_us = 1e6}, 1);
  EXPECT_EQ(adapter.to_wire(100ms).at, 1100ms);
  EXPECT_EQ(adapter.to_wire(200ms).at, 1100ms);
}

TEST(HostAdapter, JitterDoesNotReorderFrames) {
  HostAdapter adapter(
      {.tx_us = 50, .rx_us = 50, .jitter_us = 100, .tail_us = 1000, .tail_probability = 0.1}, 1);
  SimTime before{0};
  for (int n = 0; n < 1000; ++n) {
    const SimTime at = 10us * n;
    const SimTime there = adapter.to_wire(at).at;
    EXPECT_GE(there, before);
    EXPECT_GE(there, at);
    before = there;
    adapter.from_wire(reply(at));
  }
  const auto times = arrivals(adapter);
  EXPECT_TRUE(std::ranges::is_sorted(times));
}

TEST(HostAdapter, ProfilesHaveUniqueNamesAndSources) {
  EXPECT_EQ(adapter_profiles().front().name, "none");
  EXPECT_FALSE(adapter_profiles().front().times.any());
  for (const AdapterProfile& profile : adapter_profiles()) {
    EXPECT_EQ(find_adapter(profile.name), &profile);
    EXPECT_FALSE(profile.source.empty());
  }
  EXPECT_EQ(find_adapter("ch349"), nullptr);
}

// --- a bus behind an adapter

BusConfig behind(std::string_view profile) {
  BusConfig config = test::bus_config({1, 2}, 1'000'000);
  config.adapter = find_adapter(profile);
  return config;
}

TEST(BusBehindAnAdapter, RepliesArriveAtTheAdaptersTicks) {
  Bus bus(behind("usb_can"));
  for (const SimTime at : {0us, 400us}) bus.receive({at, frame("141#9C00000000000000")});
  EXPECT_TRUE(run_until(bus, 999us).empty());
  EXPECT_EQ(bus.stats().replies_waiting, 2U);
  EXPECT_EQ(bus.next_due(), 1ms);
  const auto replies = run_until(bus, 1ms);
  ASSERT_EQ(replies.size(), 2U);
  for (const TimedFrame& one : replies) EXPECT_EQ(one.at, 1ms);
  EXPECT_EQ(bus.stats().replies, 2U);
}

TEST(BusBehindAnAdapter, QueriesAreDelayed) {
  Bus plain(behind("none"));
  Bus late(behind("slcan_115200"));
  std::vector<TimedFrame> replies;
  for (Bus* const bus : {&plain, &late}) {
    bus->receive({0s, frame("141#9C00000000000000")});
    bus->advance_to(10ms);
    bus->take_replies(replies);
  }
  ASSERT_EQ(replies.size(), 2U);
  // Both ways: 22 characters of 10 bits at 115200 baud each.
  const SimTime more = replies[1].at - replies[0].at;
  EXPECT_NEAR(std::chrono::duration<double>(more).count(), 2 * 220.0 / 115'200, 1e-8);
}

TEST(BusBehindAnAdapter, OverrunIsAnErrorFrame) {
  Bus bus(behind("usb_can"));
  bus.apply({kWholeBus, SetFault{test::fault_of("adapter_overrun", {1})}});
  for (const SimTime at : {0us, 300us}) bus.receive({at, frame("141#9C00000000000000")});
  const auto replies = run_until(bus, 2ms);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0].frame.id, 0x141U);
  EXPECT_EQ(replies[1].frame.kind, protocol::FrameKind::kError);
  EXPECT_EQ(replies[1].frame.id, 0x004U);      // CAN_ERR_CRTL
  EXPECT_EQ(replies[1].frame.data[1], 0x01U);  // CAN_ERR_CRTL_RX_OVERFLOW
  EXPECT_EQ(bus.stats().replies_lost, 1U);
  EXPECT_EQ(bus.stats().error_frames, 1U);
  EXPECT_EQ(bus.faults()[0].evidence.effects, 1U);
}

TEST(BusBehindAnAdapter, FaultLatencyEndsWithTheFault) {
  Bus bus(test::bus_config({1}));
  Fault fault = test::fault_of("adapter_latency", {1000, 2000});
  fault.duration = 5ms;
  bus.apply({kWholeBus, SetFault{fault}});
  for (const SimTime at : {0ms, 10ms}) bus.receive({at, frame("141#9C00000000000000")});
  const auto replies = run_until(bus, 20ms);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0].at, 3ms);
  EXPECT_EQ(replies[1].at, 10ms);
}

TEST(BusBehindAnAdapter, SameSeedGivesTheSameTimes) {
  const auto run = [](SimTime step) {
    Bus bus(behind("ch348"));
    for (SimTime at{0}; at < 200ms; at += 1ms) {
      bus.receive({at, frame("141#9C00000000000000")});
      for (SimTime t = at; t < at + 1ms; t += step) bus.advance_to(t);
    }
    return run_until(bus, 300ms);
  };
  const auto once = run(1ms);
  EXPECT_TRUE(once == run(130us));
  EXPECT_EQ(once.size(), 200U);
}

// --- RS-485 behind an adapter

BusConfig line_behind(std::string_view profile) {
  std::vector<ServoConfig> drives;
  for (int id = 1; id <= 3; ++id) drives.push_back(test::serial_drive(Generation::kV236, id));
  BusConfig config = test::serial_bus(std::move(drives), 2'000'000);
  config.adapter = find_adapter(profile);
  return config;
}

/// Returns rounds per second of an infinitely fast host that queries three states.
double polled_Hz(std::string_view profile) {
  constexpr int kRounds = 1500;
  test::SerialHost host(line_behind(profile));
  for (int n = 0; n < 3 * kRounds; ++n) {
    host.bus.receive({host.bus.time(), kAskSerial[n % 3]});
    std::vector<TimedFrame> replies;
    while (replies.empty()) replies = host.read_until(*host.bus.next_due());
  }
  return kRounds / std::chrono::duration<double>(host.bus.time()).count();
}

TEST(LineBehindAnAdapter, PollingReachesTheMeasuredRates) {
  EXPECT_NEAR(polled_Hz("none"), 1389, 1);  // 1 / (3 · (90 + 150) us)
  const double ch348_Hz = polled_Hz("ch348");
  EXPECT_GE(ch348_Hz, 415 * 0.95);
  EXPECT_LE(ch348_Hz, 443 * 1.05);
}

/// 62 bytes: four replies of 13 and ten bytes of a fifth, which fills the buffer; then all arrive.
TEST(LineBehindAnAdapter, BufferCapacityIsInBytes) {
  test::SerialHost host(line_behind("ftdi_default"));
  std::vector<TimedFrame> replies;
  for (int n = 0; n < 5; ++n) {
    host.bus.receive({host.bus.time(), kAskSerial[0]});
    replies = host.read_until(host.bus.time() + 500us);
    EXPECT_EQ(replies.size(), n < 4 ? 0U : 5U) << n;
  }
}

/// 20 bytes are one reply and seven bytes of the next; the third is lost.
TEST(LineBehindAnAdapter, OverrunLosesBytes) {
  test::SerialHost host(line_behind("ftdi_default"));
  host.bus.apply({kWholeBus, SetFault{test::fault_of("adapter_overrun", {20})}});
  for (int n = 0; n < 3; ++n) {
    host.bus.receive({host.bus.time(), kAskSerial[0]});
    host.bus.advance_to(host.bus.time() + 500us);
  }
  const auto replies = host.read_until(20ms);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0].frame.kind, protocol::FrameKind::kSerial);
  EXPECT_EQ(replies[1].frame.kind, protocol::FrameKind::kBytes);
  EXPECT_EQ(replies[1].frame.dlc, 7);
  EXPECT_EQ(host.bus.stats().error_frames, 0U);
  EXPECT_EQ(host.bus.stats().replies_lost, 1U);
  EXPECT_EQ(host.bus.faults()[0].evidence.effects, 2U);
}

}  // namespace host_adapter_test
}  // namespace lk::emulator
