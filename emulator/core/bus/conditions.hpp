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

/// What waits on a bus until its condition holds: directives, and beginnings of faults. A value.
class Conditions {
 public:
  /// Conditions that are waited for at once.
  static constexpr std::size_t kMost = 1000;

  bool empty() const { return waiting_.empty(); }
  bool full() const { return waiting_.size() >= kMost; }
  /// `task` waits for `when`, which does not count before `from`. There must be room.
  void add(SimTime from, const Condition& when, Task task);
  /// The drive `id` is sent `command`, DATA[0]. Returns whether this completes a count.
  bool count(int id, std::uint8_t command, SimTime now);
  /// Looks at them in the order in which they were added; those that hold no longer wait. `view`
  /// gives a drive as it is now.
  std::vector<Task> take_due(SimTime now, const std::function<DriveView(int id)>& view);
  /// The beginning of this fault does not wait any more.
  void forget_fault(std::size_t fault);
  void forget_directives();
  /// Directives that wait, without the beginnings of faults.
  std::size_t directives() const;

 private:
  struct Waiting {
    SimTime from;
    Condition when;
    Task task;
    int seen = 0;                                 // frames
    std::optional<double> before = std::nullopt;  // the signal, when it was last looked at
    bool due = false;                             // holds, and is about to be done
  };
  static bool is_directive(const Waiting& waiting) {
    return std::holds_alternative<Directive>(waiting.task);
  }
  static bool holds(Waiting& waiting, const std::function<DriveView(int id)>& view);

  std::vector<Waiting> waiting_;
};

}  // namespace lk::emulator
