#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "emulator/core/directive.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

// Tasks for the drive `id`.

/// Next step of a supply voltage ramp.
struct SupplyStep {
  int id;
};
/// The end of a sag.
struct SagEnd {
  int id;
};
/// The end of the oldest pending flash write of a drive.
struct RomWritten {
  int id;
};
/// The end of the first or second half of a calibration (0x18).
struct CalibrationStep {
  int id;
};
/// The end of a power cycle.
struct Reconnect {
  int id;
};
/// The end of a drive's bus-off recovery time.
struct BusOffEnd {
  int id;
};

/// The next step of Node::unasked.
struct UnaskedStep {
  int id;
};

// Tasks for a fault; `fault` is its order on the board (FaultBoard).

/// Begin and end of one occurrence of a fault.
struct FaultBegin {
  std::size_t fault;
};
struct FaultEnd {
  std::size_t fault;
};
/// The drive `id` sends its next unsolicited frame.
struct Babbling {
  std::size_t fault;
  int id;
};
/// Sampling of conditions and lasting faults.
struct Sample {};

using Task = std::variant<Directive, SupplyStep, SagEnd, RomWritten, CalibrationStep, Reconnect,
                          BusOffEnd, UnaskedStep, FaultBegin, FaultEnd, Babbling, Sample>;

/// Tasks of a bus besides frames, by time. At equal times configured tasks come first; among equal
/// ranks the task scheduled first comes first. Copies are independent.
class Agenda {
 public:
  enum class Rank : std::uint8_t { kConfigured, kRuntime };
  void schedule(SimTime at, Task task, Rank rank = Rank::kRuntime) {
    entries_.push_back({at, rank, scheduled_++, std::move(task)});
    std::ranges::push_heap(entries_, later);
  }
  /// Ensures a sample at `at` or earlier; at most one is pending.
  void sample_by(SimTime at, Rank rank = Rank::kRuntime) {
    if (next_sample_ && *next_sample_ <= at) return;
    next_sample_ = at;
    schedule(at, Sample{}, rank);
  }
  /// Clears the pending sample if it is due. Call after each sample, due or early.
  void clear_due_sample(SimTime now) {
    if (next_sample_ && *next_sample_ <= now) next_sample_.reset();
  }
  std::optional<SimTime> next_due() const {
    return entries_.empty() ? std::nullopt : std::optional(entries_.front().at);
  }
  /// Pre: `next_due()` has a value. Removes and returns the next task.
  Task take() {
    std::ranges::pop_heap(entries_, later);
    Task task = std::move(entries_.back().task);
    entries_.pop_back();
    return task;
  }
  /// Number of pending directives.
  std::size_t directives() const {
    return static_cast<std::size_t>(std::ranges::count_if(entries_, is_directive));
  }
  void cancel_directives() {
    cancel_if<Directive>([](const Directive& /*directive*/) { return true; });
  }
  /// Removes the tasks of this kind for a drive.
  template <class Kind>
  void cancel(int id) {
    cancel_if<Kind>([id](const Kind& task) { return task.id == id; });
  }
  /// Removes the tasks of this kind for a fault.
  template <class Kind>
  void cancel_fault(std::size_t fault) {
    cancel_if<Kind>([fault](const Kind& task) { return task.fault == fault; });
  }

 private:
  struct Entry {
    SimTime at;
    Rank rank;
    std::uint64_t number;
    Task task;
  };
  static bool later(const Entry& one, const Entry& other) {
    return std::tie(one.at, one.rank, one.number) > std::tie(other.at, other.rank, other.number);
  }
  static bool is_directive(const Entry& entry) {
    return std::holds_alternative<Directive>(entry.task);
  }
  template <class Kind, class Which>
  void cancel_if(const Which& which) {
    const auto meant = [&](const Entry& entry) {
      const auto* task = std::get_if<Kind>(&entry.task);
      return task != nullptr && which(*task);
    };
    if (std::erase_if(entries_, meant) > 0) std::ranges::make_heap(entries_, later);
  }

  std::vector<Entry> entries_;  // a heap, the next entry first
  std::uint64_t scheduled_ = 0;
  std::optional<SimTime> next_sample_;
};

}  // namespace lk::emulator
