#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/servo/signals.hpp"

namespace lk::emulator {

/// One signal of one drive.
struct SampledColumn {
  int id = 1;
  const Signal* signal = nullptr;
};

/// Samples drives of a bus at a constant period of simulated time. The owner of the bus stops it at
/// `next_due` and calls `sample` there, so values do not depend on where else the bus stops.
class Sampler {
 public:
  /// The first sample is at `start`. The drives must be on the bus; `period` > 0.
  Sampler(std::vector<SampledColumn> columns, SimTime start, SimTime period)
      : columns_(std::move(columns)), period_(period), next_due_(start) {}

  const std::vector<SampledColumn>& columns() const { return columns_; }
  SimTime next_due() const { return next_due_; }
  /// Writes the values at `bus.time()` to `row`, one per column. The next sample is a period later.
  void sample(const Bus& bus, std::vector<double>& row);

 private:
  std::vector<SampledColumn> columns_;
  SimTime period_;
  SimTime next_due_;
};

/// Advances `bus` to `until`; stops at each watcher's `next_due()` for its `sample(bus)`. Motors
/// may lag after the last sample (Bus::deliver_to). Returns false if the bus waits for shared
/// motors: call again to continue.
template <class... Watchers>
bool deliver_watched(Bus& bus, SimTime until, Watchers&... watchers) {
  for (;;) {
    SimTime due = SimTime::max();
    ((due = std::min(due, watchers.next_due())), ...);
    if (due > until) {
      return bus.deliver_to(until);
    }
    if (!bus.advance_to(due)) return false;
    const auto sample_due = [&](auto& watcher) {
      if (watcher.next_due() <= due) watcher.sample(bus);
    };
    (sample_due(watchers), ...);
  }
}

/// As `deliver_watched`, but no motor lags.
template <class... Watchers>
bool advance_watched(Bus& bus, SimTime until, Watchers&... watchers) {
  return deliver_watched(bus, until, watchers...) && bus.settle();
}

}  // namespace lk::emulator
