#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/fault.hpp"
#include "emulator/core/seed.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// A fault on a running bus. Kept after its end, for reports.
struct LiveFault {
  Fault fault;
  FaultEvidence evidence;
  std::size_t order = 0;  // number of faults armed before it
  std::int64_t beginnings = 0;
  SimTime since{0};                  // last beginning
  std::optional<SimTime> looked_at;  // last sample of its effect
  std::vector<double> anchors;       // rad: outputs of `fault.ids` at the last beginning
  std::uint64_t destroyed = 0;       // number of frames since the last beginning
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
  /// Returns the next random number of this fault, in [0, 1).
  double draw() { return uniform(random = mix(random)); }
  /// Returns whether it hits this frame. A certain fault draws no number.
  bool hits() { return fault.probability >= 1 || draw() < fault.probability; }
  /// Counts an effect at `now` on the drive `id` or kWholeBus, and on a frame if not null.
  void took_effect(SimTime now, int id, const protocol::Frame* frame = nullptr);
};

}  // namespace lk::emulator
