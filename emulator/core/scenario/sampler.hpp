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

/// Looks at drives of a bus at equal steps of simulated time. Whoever advances the bus stops at
/// `next_due` and calls `look` there, so a sample is that instant's whatever the slicing.
class Sampler {
 public:
  /// The first sample is at `start`. The drives must be on the bus; `period` > 0.
  Sampler(std::vector<SampledColumn> columns, SimTime start, SimTime period)
      : columns_(std::move(columns)), period_(period), next_due_(start) {}

  const std::vector<SampledColumn>& columns() const { return columns_; }
  SimTime next_due() const { return next_due_; }
  /// The values at `bus.time()`, one for each column, into `row`; the next sample is one period on.
  void look(const Bus& bus, std::vector<double>& row);

 private:
  std::vector<SampledColumn> columns_;
  SimTime period_;
  SimTime next_due_;
};

/// Brings `bus` to `until` and stops on the way wherever a watcher wants to look: each has
/// `next_due()` and `look(bus)`. After the last look the motors may stay behind (Bus::deliver_to).
/// Returns false where the bus has to wait for its motors, to go on from there when called again.
template <class... Watchers>
bool deliver_watched(Bus& bus, SimTime until, Watchers&... watchers) {
  for (;;) {
    SimTime due = SimTime::max();
    ((due = std::min(due, watchers.next_due())), ...);
    if (due > until) {
      return bus.deliver_to(until);
    }
    if (!bus.advance_to(due)) return false;
    const auto look = [&](auto& watcher) {
      if (watcher.next_due() <= due) watcher.look(bus);
    };
    (look(watchers), ...);
  }
}

/// The same, and nothing stays behind.
template <class... Watchers>
bool advance_watched(Bus& bus, SimTime until, Watchers&... watchers) {
  return deliver_watched(bus, until, watchers...) && bus.settle();
}

}  // namespace lk::emulator
