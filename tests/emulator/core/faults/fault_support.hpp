#pragma once

/// @file Faults on a bus with noiseless drives, for tests.

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/faults.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::test {

using emulator::FaultEvidence;
using emulator::SimTime;

struct Course {
  std::optional<SimTime> duration = std::nullopt;
  std::optional<SimTime> every = std::nullopt;
  int times = 0;
};

inline emulator::Fault fault(std::string_view kind,
                             const std::vector<emulator::FaultValue>& values = {},
                             Course course = {}, std::vector<int> ids = {1},
                             std::string name = {}) {
  emulator::Fault made = fault_of(kind, {}, std::move(ids));
  std::ranges::copy(values, made.values.begin());
  made.name = std::move(name);
  made.duration = course.duration;
  made.every = course.every;
  made.times = course.times;
  return made;
}

/// Starts a fault now.
inline void inject(Host& host, std::string_view kind,
                   const std::vector<emulator::FaultValue>& values = {}, Course course = {},
                   std::vector<int> ids = {1}) {
  host.bus.apply(
      {emulator::kWholeBus, emulator::SetFault{fault(kind, values, course, std::move(ids))}});
}

inline void clear(Host& host, const std::string& which = "all") {
  host.bus.apply({emulator::kWholeBus, emulator::ClearFault{which}});
}

inline FaultEvidence evidence(const Host& host, std::size_t n = 0) {
  return host.bus.faults().at(n).evidence;
}

/// Returns whether drive `id` answers 0x9C.
inline bool answers(Host& host, int id = 1) {
  protocol::Frame query;
  query.id = 0x140U + static_cast<std::uint32_t>(id);
  query.data[0] = 0x9C;
  return !host.talk(query).empty();
}

/// Checks effects on drive 1: the first one at most one sample after `since`, and at least
/// `effects`.
inline void expect_shown(const FaultEvidence& evidence, SimTime since, std::uint64_t effects = 1) {
  ASSERT_TRUE(evidence.first_effect_at);
  EXPECT_GE(*evidence.first_effect_at, since);
  EXPECT_LE(*evidence.first_effect_at, since + emulator::kSamplePeriod);
  EXPECT_GE(evidence.effects, effects);
  EXPECT_EQ(evidence.first_on.substr(0, 7), "drive 1");
}

}  // namespace lk::test
