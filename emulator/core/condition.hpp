#pragma once

/// @file What can be waited for on a running bus: plain values.

#include <cstdint>
#include <variant>

#include "model/setpoint.hpp"

namespace lk::emulator {

struct Signal;

/// The drive has been sent the command `command` (DATA[0]), in frames of its own, so many times
/// since this was asked for.
/// The frame that completes the number is the first one for which the condition holds.
struct CommandSeen {
  std::uint8_t command = 0;
  int count = 1;
};
enum class Edge : std::uint8_t { kAbove, kBelow, kCrosses };
/// A signal is at or above the level, or at or below it; or passes it, in either direction. Looked
/// at every Bus::kLookStep.
struct SignalReaches {
  const Signal* signal = nullptr;
  Edge edge = Edge::kAbove;
  double level = 0;
};
/// An error bit is set.
struct ErrorSet {
  model::Error error = model::Error::kUnderVoltage;
};

/// Of the drive `id`, which must be on the bus.
struct Condition {
  int id = 1;
  std::variant<CommandSeen, SignalReaches, ErrorSet> what;
};

}  // namespace lk::emulator
