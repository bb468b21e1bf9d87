#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/core/bus/bus.hpp"

namespace lk::emulator {

/// Delays on a bus that hosts do not cause: injected faults, a disturbed wire, time that slipped.
/// The queue that has grown meanwhile is sent while hosts go on.
class Disturbances {
 public:
  /// Time in which the queue is sent (assumed).
  static constexpr SimTime kAftermath = std::chrono::seconds(1);

  void look(const Bus& bus, const BusStats& stats);
  /// Time has slipped at `now`: what hosts sent meanwhile comes at once.
  void note_slip(SimTime now) {
    slip_until_ = now + kAftermath;
    extend(now);
  }
  bool after_slip(SimTime now) const { return now < slip_until_; }
  bool last(SimTime now) const { return now < until_; }
  /// A fault holds up what hosts write.
  bool writes_stall(SimTime now) const { return now < stalled_until_; }

 private:
  void extend(SimTime from) { until_ = std::max(until_, from + kAftermath); }

  std::uint64_t foreign_ = 0;  // frames so far that no host is to blame for
  SimTime until_{0};
  SimTime slip_until_{0};
  SimTime stalled_until_{0};
};

/// Hosts that send faster than the wire carries.
class WireWatch {
 public:
  /// Two for each drive that a bus can have: a round of queries at once is no overload (assumed).
  static constexpr std::uint64_t kWaiting = 64;
  static constexpr SimTime kLong = std::chrono::milliseconds(100);  // assumed

  /// A frame of a host.
  std::optional<Finding> hear() const;
  void look(const Bus& bus, const BusStats& stats, bool disturbed);

 private:
  std::optional<SimTime> crowded_since_;
  std::uint64_t waiting_ = 0;
  std::uint64_t lost_ = 0;  // so far
  bool too_fast_ = false;
};

/// Queries that a drive does not take, as it has too many to answer.
class BusyWatch {
 public:
  struct Busy {
    Finding finding;
    std::uint64_t times;
  };
  std::optional<Busy> look(const BusStats& stats);

 private:
  std::uint64_t seen_ = 0;
};

}  // namespace lk::emulator
