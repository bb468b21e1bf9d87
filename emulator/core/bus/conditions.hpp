#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "emulator/core/bus/agenda.hpp"
#include "emulator/core/condition.hpp"
#include "emulator/core/servo/signals.hpp"

namespace lk::emulator {

/// Directives and beginnings of faults that wait for a condition. Copies are independent.
class Conditions {
 public:
  /// Limit of pending conditions.
  static constexpr std::size_t kMax = 1000;

  bool empty() const { return waiting_.empty(); }
  bool full() const { return waiting_.size() >= kMax; }
  /// Pre: `!full()`. Lets `task` wait for `when`, which is not tested before `from`.
  void add(SimTime from, const Condition& when, Task task);
  /// Counts `command` (DATA[0]) sent to the drive `id`. Returns true if a count is complete.
  bool count(int id, std::uint8_t command, SimTime now);
  /// Removes and returns the tasks whose conditions hold, in order of `add`. `view` returns the
  /// present state of a drive.
  std::vector<Task> take_due(SimTime now, const std::function<DriveView(int id)>& view);
  /// Removes the pending beginning of this fault.
  void cancel_fault(std::size_t fault);
  void cancel_directives();
  /// Number of pending directives, without beginnings of faults.
  std::size_t directives() const;

 private:
  struct Waiting {
    SimTime from;
    Condition when;
    Task task;
    int seen = 0;                                 // frames counted
    std::optional<double> before = std::nullopt;  // last sampled value of the signal
    bool due = false;                             // holds; the task is returned next
  };
  static bool is_directive(const Waiting& waiting) {
    return std::holds_alternative<Directive>(waiting.task);
  }
  static bool holds(Waiting& waiting, const std::function<DriveView(int id)>& view);

  std::vector<Waiting> waiting_;
};

}  // namespace lk::emulator
