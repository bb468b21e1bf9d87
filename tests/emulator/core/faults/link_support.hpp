#pragma once

/// @file A bus with link faults, for tests. Lengths counted by hand in can_wire_test.cpp and
/// bus_test.cpp: the query 141#9A00… has 120 bits, its reply 141#9A1900F0… 118, each followed by 3
/// bits of intermission. An error frame has 8 bits of delimiter and 3 of intermission after its
/// flags, which end where the frame would have ended.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/faults.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {

using namespace std::chrono_literals;
using protocol::Frame;
using protocol::FrameKind;
using test::bus_config;
using test::frame;

inline constexpr std::int64_t kBitrate = 1'000'000;
inline const Frame kAsk = frame("141#9A00000000000000");
inline const Frame kAnswer = frame("141#9A1900F000000000");
inline const Frame kState2 = frame("141#9C00000000000000");
inline const Frame kState2Answer = frame("141#9C19000000000008");
inline const Frame kTorque = frame("141#A100000064000000");
enum class Frames : std::uint8_t { kReplies, kQueries, kBoth };
using enum Frames;

/// Returns the `n`-th of a series of queries: 0x9A, 0x9C and 0x92 in turn.
inline Frame mixed_query(int n) {
  Frame query = kState2;
  query.data[0] = n % 3 == 0 ? 0x9A : n % 3 == 1 ? 0x9C : 0x92;
  return query;
}

inline Fault fault(std::string_view kind, std::vector<int> ids,
                   std::initializer_list<FaultValue> values = {}, double probability = 1) {
  Fault made = test::fault_of(kind, values, std::move(ids));
  made.probability = probability;
  return made;
}

/// A bus, controls for its faults, and the received frames.
struct Rig {
  explicit Rig(const BusConfig& config) : bus(config) {}

  void set(const Fault& made) { bus.apply({kWholeBus, SetFault{made}}); }
  void clear() { bus.apply({kWholeBus, ClearFault{"all"}}); }
  /// Sends a query now; returns the frames received within `window`.
  std::vector<Frame> talk(const Frame& query, SimTime window = 0ns) {
    bus.receive({bus.time(), query});
    return wait(window);
  }
  std::vector<Frame> talk(std::string_view query, SimTime window = 0ns) {
    return talk(frame(query), window);
  }
  std::vector<Frame> wait(SimTime window) {
    bus.advance_to(bus.time() + window);
    std::vector<Frame> frames;
    const std::size_t before = seen.size();
    bus.take_replies(seen);
    for (std::size_t n = before; n < seen.size(); ++n) frames.push_back(seen[n].frame);
    return frames;
  }
  std::uint64_t effects(std::size_t index = 0) const {
    return bus.faults()[index].evidence.effects;
  }
  std::uint64_t dropped(Drop cause) const { return bus.stats().count(cause); }

  Bus bus;
  std::vector<TimedFrame> seen;
};

inline void expect_balanced(const Bus& bus, const std::vector<TimedFrame>& seen,
                            std::string_view what) {
  const BusStats stats = bus.stats();
  std::uint64_t dropped = 0;
  for (const std::uint64_t count : stats.dropped) dropped += count;
  EXPECT_EQ(stats.frames, stats.queries + dropped + stats.frames_waiting) << what;
  std::uint64_t given = 0;
  for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) {
    if (bus.has(id)) given += bus.servo(id).stats.replies;
  }
  EXPECT_EQ(given + stats.extra_frames, stats.replies + stats.replies_lost + stats.replies_waiting)
      << what;
  const auto errors = std::ranges::count_if(
      seen, [](const TimedFrame& one) { return one.frame.kind == FrameKind::kError; });
  EXPECT_EQ(stats.error_frames, static_cast<std::uint64_t>(errors)) << what;
  EXPECT_EQ(stats.replies, seen.size() - static_cast<std::size_t>(errors)) << what;
}

}  // namespace lk::emulator
