/// @file The hosts' side of a CAN bus against a model of it.

#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/faults/make_fault.hpp"
#include "protocol/frame_bits.hpp"
#include "tests/emulator/core/core_support.hpp"
#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace host_side_test {

using namespace std::chrono_literals;
using test::bus_config;
using test::frame;

constexpr std::int64_t kBitrate = 1'000'000;  // a bit is a microsecond
const HostQueue kSmall{.name = "custom", .frames = 13, .full = QueueFull::kRefuse};

using Times = std::vector<std::pair<SimTime, SimTime>>;

/// Model of a host that sends to a drive that does not exist, on a bus where the other nodes
/// acknowledge at times.
struct Model {
  std::vector<SimTime> edges;  // the acknowledgement ends, begins, ends, ...
  Times offs;                  // the host's controller is off
  std::size_t capacity = 1024;
  std::vector<SimTime> sent;  // ends of the frames that were acknowledged
  std::uint64_t refused = 0;
  SimTime free{0};
  int errors = 0;
  std::deque<std::pair<SimTime, int>> queue;  // written at; bits

  bool acknowledged(SimTime t) const {
    return std::ranges::count_if(edges, [t](SimTime edge) { return edge <= t; }) % 2 == 0;
  }
  void write(SimTime at, int bits) {
    advance(at);
    if (!offs.empty() && offs.front().first <= at) return;
    if (queue.size() < capacity) {
      queue.emplace_back(at, bits);
    } else {
      ++refused;
    }
  }
  void advance(SimTime until) {
    while (!offs.empty() && offs.front().first <= until) {
      const auto [begin, end] = offs.front();
      send(begin - 1ns);
      if (!queue.empty() && std::max(queue.front().first, free) <= begin) {
        free = std::max(queue.front().first, free) + (queue.front().second + 3) * 1us;
      }
      queue.clear();
      errors = 0;
      if (until < end) return;
      offs.erase(offs.begin());
    }
    send(until);
  }
  void send(SimTime until) {
    while (!queue.empty()) {
      const auto [written, bits] = queue.front();
      const SimTime begin = std::max(written, free);
      const SimTime end = begin + bits * 1us;
      if (end > until) return;
      if (acknowledged(end)) {
        sent.push_back(end);
        queue.pop_front();
        free = end + 3us;
        errors = std::max(0, errors - 1);
      } else {  // flag 6, delimiter 8, intermission 3 after the ACK slot; 8 more if passive
        errors = std::max(errors, std::min(errors + 8, 128));
        free = end - 8us + 17us + (errors >= 128 ? 8us : 0us);
      }
    }
  }
};

TimedDirective fault_at(const char* word, SimTime at, std::optional<SimTime> duration) {
  Fault fault = fault_of(*find_fault(word));
  fault.duration = duration;
  return {at, {kWholeBus, SetFault{fault}}};
}

/// Frames with sender 7 come back when they have left the wire.
std::vector<SimTime> sent_frames(Bus& bus) {
  std::vector<TimedFrame> all;
  bus.take_replies(all);
  std::vector<SimTime> sent;
  for (const TimedFrame& one : all) {
    if (one.sender == 7) sent.push_back(one.at);
  }
  return sent;
}

/// Drives that lose power about 450 ms after their supply.
BusConfig powered_config(std::initializer_list<int> ids) {
  return test::powered_bus(ids, kBitrate);
}

protocol::Frame stray(int n) {
  auto query = frame("145#A400000000000000");
  query.data[4] = static_cast<std::uint8_t>(n);
  query.data[5] = static_cast<std::uint8_t>(n >> 8);
  return query;
}

class Backlog : public testing::TestWithParam<std::size_t> {};

/// The cable is cut for 2 s while a host sends every 5 ms, or faster to fill the queue.
TEST_P(Backlog, IsSentAsTheModelSays) {
  BusConfig config = bus_config({1}, kBitrate);
  config.host_queue = {.name = "custom", .frames = GetParam(), .full = QueueFull::kRefuse};
  config.events.push_back(fault_at("no_ack", 100ms, 2s));
  Bus bus(config);
  Model model{.edges = {100ms, 2100ms}, .offs = {}, .capacity = GetParam()};
  const SimTime period = std::min<SimTime>(5ms, 1500ms / static_cast<int>(GetParam()));
  std::uint64_t refused = 0;
  for (int n = 0; n * period < 3s; ++n) {
    const SimTime at = n * period;
    bus.advance_to(at);
    const bool taken = bus.receive({.at = at, .frame = stray(n), .sender = 7});
    refused += taken ? 0U : 1U;
    model.write(at, protocol::frame_bits(stray(n)));
  }
  bus.advance_to(4s);
  model.advance(4s);
  EXPECT_EQ(sent_frames(bus), model.sent);
  EXPECT_EQ(refused, model.refused);
  EXPECT_GT(refused, 0U);
  EXPECT_GE(bus.stats().replayed, GetParam());
  EXPECT_EQ(bus.stats().stale, GetParam());
}
INSTANTIATE_TEST_SUITE_P(Queues, Backlog, testing::Values(10, 128, 512, 1000));

/// A host without a node to acknowledge becomes error-passive and not more.
TEST(HostSide, StaysErrorPassiveWithoutAcknowledgement) {
  BusConfig config = bus_config({1}, kBitrate);
  config.events.push_back(fault_at("no_ack", 0ms, std::nullopt));
  Bus bus(config);
  bus.receive({0us, stray(0)});
  bus.advance_to(1s);
  std::vector<TimedFrame> reports;
  bus.take_replies(reports);
  ASSERT_EQ(reports.size(), 3U);
  EXPECT_EQ(reports[0].frame.id, 0x220U);  // CAN_ERR_ACK, CAN_ERR_CNT
  EXPECT_EQ(reports[0].frame.data[6], 8);
  EXPECT_EQ(reports[1].frame.id, 0x204U);     // CAN_ERR_CRTL, CAN_ERR_CNT
  EXPECT_EQ(reports[1].frame.data[1], 0x08);  // CAN_ERR_CRTL_TX_WARNING
  EXPECT_EQ(reports[1].frame.data[6], 96);
  EXPECT_EQ(reports[2].frame.data[1], 0x20);  // CAN_ERR_CRTL_TX_PASSIVE
  EXPECT_EQ(reports[2].frame.data[6], 128);
  EXPECT_EQ(bus.state().host.errors.transmit_errors, 128);
}

/// All drives lose their power; the last of three still acknowledges before.
TEST(HostSide, OneDriveLeftAcknowledges) {
  BusConfig config = powered_config({1, 2, 3});
  config.host_queue = kSmall;
  Bus bus(config);
  for (const int id : {1, 3}) bus.apply({id, PowerOff{}});
  bus.advance_to(1s);
  for (int n = 0; n < 50; ++n) {
    bus.receive({bus.time(), stray(n)});
    bus.advance_to(bus.time() + 1ms);
  }
  EXPECT_EQ(bus.stats().frames_waiting, 0U);
  bus.apply({2, PowerOff{}});
  bus.advance_to(2s);
  for (int n = 0; n < 50; ++n) {
    bus.receive({bus.time(), stray(n)});
    bus.advance_to(bus.time() + 1ms);
  }
  EXPECT_EQ(bus.stats().frames_waiting, 13U);
  EXPECT_EQ(bus.stats().count(Reject::kQueueFull), 37U);
}

/// Its error flags destroy 16 frames, until its error counter is 128; then no node acknowledges.
TEST(HostSide, ADriveAloneAtAnotherBitRateDestroysFrames) {
  BusConfig config = bus_config({1}, kBitrate);
  Fault fault = fault_of(*find_fault("wrong_bitrate"));
  fault.ids = {1};
  config.events.push_back({0ms, {kWholeBus, SetFault{fault}}});
  Bus bus(config);
  bus.receive({bus.time(), stray(0)});
  bus.advance_to(500ms);
  EXPECT_EQ(bus.faults().at(0).evidence.effects, 16U);
  EXPECT_EQ(bus.stats().unacknowledged, 1U);
}

TEST(HostSide, DropsTheOldestFrameThatIsNotOnTheWire) {
  BusConfig config = bus_config({1}, kBitrate);
  config.host_queue = {.name = "custom", .frames = 3, .full = QueueFull::kDropOldest};
  config.events.push_back(fault_at("no_ack", 0ms, 10ms));
  Bus bus(config);
  for (int n = 0; n < 5; ++n) {
    bus.advance_to(n * 1ms);
    EXPECT_TRUE(bus.receive({.at = n * 1ms, .frame = stray(n), .sender = 7}));
  }
  bus.advance_to(20ms);
  std::vector<TimedFrame> all;
  bus.take_replies(all);
  std::vector<int> numbers;
  for (const TimedFrame& one : all) {
    if (one.sender == 7) numbers.push_back(one.frame.data[4]);
  }
  EXPECT_EQ(numbers, (std::vector{0, 3, 4}));
}

/// Bus-off loses the queue; error frames report it and the restart.
TEST(HostSide, LosesItsQueueAtBusOff) {
  BusConfig config = bus_config({1}, kBitrate);
  config.events.push_back(fault_at("no_ack", 0ms, 10ms));
  config.events.push_back(fault_at("host_bus_off", 5ms, 100ms));
  Bus bus(config);
  for (int n = 0; n < 200; ++n) {
    bus.advance_to(n * 1ms);
    bus.receive({.at = n * 1ms, .frame = stray(n), .sender = 7});
  }
  bus.advance_to(1s);
  std::vector<TimedFrame> all;
  bus.take_replies(all);
  std::vector<std::uint32_t> errors;
  std::optional<int> first;
  for (const TimedFrame& one : all) {
    if (one.frame.kind == protocol::FrameKind::kError) errors.push_back(one.frame.id);
    if (one.sender == 7 && !first) first = one.frame.data[4];
  }
  EXPECT_EQ(errors, (std::vector<std::uint32_t>{0x220, 0x204, 0x204, 0x040, 0x100}));
  EXPECT_EQ(first, 105);
  EXPECT_EQ(bus.faults()[1].evidence.effects, 105U);  // 5 queued frames, 100 while off
}

/// Another node acknowledges: a bus without drives that are alive carries frames as before.
TEST(HostSide, NeedsNoDriveIfAnotherNodeAcknowledges) {
  BusConfig config = powered_config({1});
  config.always_acknowledged = true;
  Bus bus(config);
  bus.apply({1, PowerOff{}});
  bus.advance_to(1s);
  bus.receive({bus.time(), stray(0)});
  bus.advance_to(2s);
  EXPECT_EQ(bus.stats().frames_waiting, 0U);
}

/// Random power, cable and adapter events. The times of power come from a bus without traffic.
TEST(HostSide, FollowsTheModelThroughRandomEvents) {
  constexpr int kFrames = 1'000'000;
  std::minstd_rand random(5);
  const auto draw = [&](int most) {
    return static_cast<int>(random() % static_cast<unsigned>(most));
  };
  BusConfig config = powered_config({1});
  config.host_queue = kSmall;
  SimTime at = 50ms;
  Times cuts, offs;
  while (at < 60s) {
    const SimTime duration = (20 + draw(1500)) * 1ms;
    const int kind = draw(3);
    if (kind == 0) {
      config.events.push_back({at, {1, PowerOff{}}});
      config.events.push_back({at + duration, {1, PowerOn{}}});
    } else {
      config.events.push_back(fault_at(kind == 1 ? "no_ack" : "host_bus_off", at, duration));
      (kind == 1 ? cuts : offs).emplace_back(at, at + duration);
    }
    at += duration + (100 + draw(500)) * 1ms;
  }
  Bus still(config);
  std::vector<SimTime> edges;
  bool alive = true;
  for (std::int64_t tick = 1; time_of_tick(tick, 32'000) < at; ++tick) {
    still.advance_to(time_of_tick(tick, 32'000));
    if (still.state().nodes.of(1).power.alive != alive) {
      edges.push_back(still.time());
      alive = !alive;
    }
  }
  EXPECT_GE(edges.size(), 4U);
  for (const auto& [begin, end] : cuts) edges.insert(edges.end(), {begin, end});
  std::ranges::sort(edges);
  Bus bus(config);
  Model model{.edges = edges, .offs = offs, .capacity = kSmall.frames};
  std::uint64_t refused = 0;
  SimTime now{0};
  for (int n = 0; n < kFrames && now < at; ++n) {
    now +=
        draw(n / 1000 % 4 == 0 ? 400 : 20) * 1us;  // bursts, and pauses in which the queue empties
    bus.advance_to(now);
    refused += bus.receive({.at = now, .frame = stray(n), .sender = 7}) ? 0U : 1U;
    model.write(now, protocol::frame_bits(stray(n)));
  }
  EXPECT_LT(now, at);
  EXPECT_EQ(sent_frames(bus), model.sent);
  EXPECT_EQ(refused, model.refused);
}

}  // namespace host_side_test
}  // namespace lk::emulator
