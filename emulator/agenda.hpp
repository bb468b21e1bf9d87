#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <variant>
#include <vector>

#include "emulator/directive.hpp"
#include "emulator/sim_time.hpp"

namespace lk::emulator {

/// The next step of a supply's way to its new voltage.
struct SupplyStep {
  std::size_t seat;
};
/// The end of a sag.
struct SagEnd {
  std::size_t seat;
};
/// A drive's memory has taken the write it began first.
struct RomWritten {
  std::size_t seat;
};
/// The end of a power cycle.
struct Reconnect {
  std::size_t seat;
};
using Task = std::variant<Directive, SupplyStep, SagEnd, RomWritten, Reconnect>;

/// What is going to happen on a bus besides frames, in order of time; what was entered first comes
/// first among equals. A value.
class Agenda {
 public:
  void enter(SimTime at, const Task& task) {
    // Latest first, so that the next one is taken from the end; before its equals, to come after.
    const auto place = std::ranges::lower_bound(entries_, at, std::ranges::greater{}, &Entry::at);
    entries_.insert(place, {at, task});
  }
  std::optional<SimTime> next_due() const {
    return entries_.empty() ? std::nullopt : std::optional(entries_.back().at);
  }
  /// The next task; there must be one.
  Task take() {
    const Task task = entries_.back().task;
    entries_.pop_back();
    return task;
  }
  /// Forgets what of this kind is to happen to a drive.
  template <class Kind>
  void forget(std::size_t seat) {
    std::erase_if(entries_, [seat](const Entry& entry) {
      const auto* task = std::get_if<Kind>(&entry.task);
      return task != nullptr && task->seat == seat;
    });
  }

 private:
  struct Entry {
    SimTime at;
    Task task;
  };
  std::vector<Entry> entries_;
};

}  // namespace lk::emulator
