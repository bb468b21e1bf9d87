#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/fault.hpp"
#include "emulator/core/seed.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// A fault on a running bus. Stays after its end, for what it has to say.
struct LiveFault {
  Fault fault;
  FaultEvidence evidence;
  std::size_t order = 0;  // so many were armed before it
  std::int64_t beginnings = 0;
  SimTime since{0};                  // when it began, this time
  std::optional<SimTime> looked_at;  // last, to see what shows of it
  std::vector<double> anchors;       // rad: where the outputs of `fault.ids` stood then
  std::uint64_t destroyed = 0;       // frames on the wire, this time
  std::uint64_t random = 1;

  const FaultRow& row() const { return *fault.row; }
  bool active() const { return evidence.state == FaultEvidence::State::kActive; }
  bool is_over() const {
    return evidence.state == FaultEvidence::State::kOver ||
           evidence.state == FaultEvidence::State::kCleared;
  }
  bool is_of(int id) const {
    return std::find(fault.ids.begin(), fault.ids.end(), id) != fault.ids.end();
  }
  bool comes_again() const { return fault.every && (fault.times == 0 || beginnings < fault.times); }
  double number(std::size_t n) const { return fault.values[n].number(); }
  template <class Choice>
  Choice choice(std::size_t n) const {
    return fault.values[n].choice<Choice>();
  }
  /// The next of this fault's own random numbers, [0, 1).
  double draw() { return uniform(random = mix(random)); }
  /// Whether it hits this frame. A certain fault draws nothing.
  bool hits() { return fault.probability >= 1 || draw() < fault.probability; }
  /// On the drive `id` or kWholeBus, at `now`; on a frame, if it was one.
  void took_effect(SimTime now, int id, const protocol::Frame* frame = nullptr);
};

}  // namespace lk::emulator
