#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/core/bus/bus.hpp"

namespace lk::emulator {

/// Delays that hosts do not cause: injected faults, a disturbed wire, time that slipped. The queue
/// that grew meanwhile is sent while hosts continue.
class Disturbances {
 public:
  /// Time to send that queue (assumed).
  static constexpr SimTime kAftermath = std::chrono::seconds(1);

  void look(const Bus& bus, const BusStats& stats);
  /// Notes that time slipped at `now`: frames that hosts sent meanwhile come together.
  void note_slip(SimTime now) {
    slip_until_ = now + kAftermath;
    extend(now);
  }
  bool after_slip(SimTime now) const { return now < slip_until_; }
  bool last(SimTime now) const { return now < until_; }
  /// Returns true while a fault delays frames of hosts.
  bool writes_stall(SimTime now) const { return now < stalled_until_; }

 private:
  void extend(SimTime from) { until_ = std::max(until_, from + kAftermath); }

  std::uint64_t foreign_ = 0;  // frames so far that hosts did not cause
  SimTime until_{0};
  SimTime slip_until_{0};
  SimTime stalled_until_{0};
};

/// Detects hosts that send faster than the wire carries.
class WireWatch {
 public:
  /// Two per drive on a full bus: one round of queries is no overload (assumed).
  static constexpr std::uint64_t kWaiting = 64;
  static constexpr SimTime kLong = std::chrono::milliseconds(100);  // assumed

  /// Returns a finding for a host's frame if the wire is overloaded.
  std::optional<Finding> hear() const;
  void look(const Bus& bus, const BusStats& stats, bool disturbed);

 private:
  std::optional<SimTime> crowded_since_;
  std::uint64_t waiting_ = 0;
  std::uint64_t lost_ = 0;  // total so far
  bool too_fast_ = false;
};

/// Detects queries that a drive rejects, as its reply queue is full.
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
