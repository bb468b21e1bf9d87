#pragma once

#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/core/bus_stats.hpp"

namespace lk::emulator {

/// Hosts that send faster than the wire carries.
class WireWatch {
 public:
  /// Two for each drive that a bus can have: a round of queries at once is no overload (assumed).
  static constexpr std::uint64_t kWaiting = 64;
  static constexpr SimTime kLong = std::chrono::milliseconds(100);  // assumed
  /// In which the pile that a disturbance has left is sent, while hosts go on (assumed).
  static constexpr SimTime kAftermath = std::chrono::seconds(1);

  /// A frame of a host.
  std::optional<Finding> hear() const;
  void look(SimTime now, const BusStats& stats);

 private:
  std::optional<SimTime> crowded_since_;
  std::uint64_t waiting_ = 0;
  std::uint64_t lost_ = 0;     // so far
  std::uint64_t foreign_ = 0;  // the same: frames that no host is to blame for
  SimTime disturbed_until_{0};
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
