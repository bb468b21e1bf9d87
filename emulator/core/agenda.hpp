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

/// The next step of a supply's way to its new voltage.
struct SupplyStep {
  std::size_t index;
};
/// The end of a sag.
struct SagEnd {
  std::size_t index;
};
/// A drive's memory has taken the write it began first.
struct RomWritten {
  std::size_t index;
};
/// The end of a power cycle.
struct Reconnect {
  std::size_t index;
};
/// A fault begins; its present time is over. By its place among the bus's faults.
struct FaultBegin {
  std::size_t fault;
};
struct FaultEnd {
  std::size_t fault;
};
/// Conditions and faults that last are looked at.
struct Look {};
/// A drive sends the next frame that nobody asked for, because of a fault.
struct Babble {
  std::size_t fault;
  std::size_t index;
};
/// A drive's controller has counted out its time off the bus.
struct BusOffEnd {
  std::size_t index;
};
using Task = std::variant<Directive, SupplyStep, SagEnd, RomWritten, Reconnect, FaultBegin,
                          FaultEnd, Look, Babble, BusOffEnd>;

/// What is going to happen on a bus besides frames, in order of time; what was entered first comes
/// first among equals. A value.
class Agenda {
 public:
  void enter(SimTime at, Task task) {
    entries_.push_back({at, entered_++, std::move(task)});
    std::ranges::push_heap(entries_, later);
  }
  std::optional<SimTime> next_due() const {
    return entries_.empty() ? std::nullopt : std::optional(entries_.front().at);
  }
  /// The next task; there must be one.
  Task take() {
    std::ranges::pop_heap(entries_, later);
    Task task = std::move(entries_.back().task);
    entries_.pop_back();
    return task;
  }
  /// How many directives are to be done.
  std::size_t directives() const {
    return static_cast<std::size_t>(std::ranges::count_if(entries_, is_directive));
  }
  void forget_directives() { forget_if(is_directive); }
  /// Forgets what of this kind is to happen to a drive.
  template <class Kind>
  void forget(std::size_t index) {
    forget_if([index](const Entry& entry) {
      const auto* task = std::get_if<Kind>(&entry.task);
      return task != nullptr && task->index == index;
    });
  }
  /// Forgets the coming beginnings and the end of a fault.
  void forget_fault(std::size_t fault) {
    forget_if([fault](const Entry& entry) {
      const auto* begin = std::get_if<FaultBegin>(&entry.task);
      const auto* end = std::get_if<FaultEnd>(&entry.task);
      return (begin != nullptr && begin->fault == fault) || (end != nullptr && end->fault == fault);
    });
  }
  /// Forgets what a babbling drive is going to say because of a fault.
  void forget_babble(std::size_t fault) {
    forget_if([fault](const Entry& entry) {
      const auto* babble = std::get_if<Babble>(&entry.task);
      return babble != nullptr && babble->fault == fault;
    });
  }

 private:
  struct Entry {
    SimTime at;
    std::uint64_t number;
    Task task;
  };
  static bool later(const Entry& one, const Entry& other) {
    return std::tie(one.at, one.number) > std::tie(other.at, other.number);
  }
  static bool is_directive(const Entry& entry) {
    return std::holds_alternative<Directive>(entry.task);
  }
  template <class Meant>
  void forget_if(Meant meant) {
    if (std::erase_if(entries_, meant) > 0) std::ranges::make_heap(entries_, later);
  }

  std::vector<Entry> entries_;  // a heap, the next one first
  std::uint64_t entered_ = 0;
};

}  // namespace lk::emulator
