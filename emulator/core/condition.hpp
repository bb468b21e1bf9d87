#pragma once

/// @file Conditions that a running bus can wait for: plain values.

#include <cstdint>
#include <variant>

#include "model/setpoint.hpp"

namespace lk::emulator {

struct Signal;

/// The drive was sent `count` single-drive frames with DATA[0] = `command` since the condition was
/// set. The condition holds before the drive processes the last of these frames.
struct CommandSeen {
  std::uint8_t command = 0;
  int count = 1;
};
enum class Edge : std::uint8_t { kAbove, kBelow, kCrosses };
/// A signal is at or above the level, at or below it, or crosses it in either direction. Sampled
/// every kSamplePeriod.
struct SignalReaches {
  const Signal* signal = nullptr;
  Edge edge = Edge::kAbove;
  double level = 0;
};
/// The error bit `error` of the drive is set.
struct ErrorSet {
  model::Error error = model::Error::kUnderVoltage;
};

/// Condition on the drive `id`, which must be on the bus.
struct Condition {
  int id = 1;
  std::variant<CommandSeen, SignalReaches, ErrorSet> what;
};

}  // namespace lk::emulator
