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

// Of the drive `id`.

/// The next step of a supply's way to its new voltage.
struct SupplyStep {
  int id;
};
/// The end of a sag.
struct SagEnd {
  int id;
};
/// A drive's memory has taken the write it began first.
struct RomWritten {
  int id;
};
/// Half of the time of a calibration has passed.
struct CalibrationStep {
  int id;
};
/// The end of a power cycle.
struct Reconnect {
  int id;
};
/// A drive's controller has counted out its time off the bus.
struct BusOffEnd {
  int id;
};

// Of a fault, by its order on the board.

/// A fault begins; its present time is over.
struct FaultBegin {
  std::size_t fault;
};
struct FaultEnd {
  std::size_t fault;
};
/// The drive `id` sends the next frame that nobody asked for.
struct Babbling {
  std::size_t fault;
  int id;
};
/// Conditions and faults that last are looked at.
struct Look {};

using Task = std::variant<Directive, SupplyStep, SagEnd, RomWritten, CalibrationStep, Reconnect,
                          BusOffEnd, FaultBegin, FaultEnd, Babbling, Look>;

/// What is going to happen on a bus besides frames, in order of time. Among equals, what the
/// configuration has comes first, then what was entered first. A value.
class Agenda {
 public:
  enum class Rank : std::uint8_t { kConfigured, kSaidLater };
  void enter(SimTime at, Task task, Rank rank = Rank::kSaidLater) {
    entries_.push_back({at, rank, entered_++, std::move(task)});
    std::ranges::push_heap(entries_, later);
  }
  /// A look at `at` at the latest; there is one at a time.
  void look_by(SimTime at, Rank rank = Rank::kSaidLater) {
    if (next_look_ && *next_look_ <= at) return;
    next_look_ = at;
    enter(at, Look{}, rank);
  }
  /// Everything has been looked at, because that was due or because somebody could not wait.
  void looked(SimTime now) {
    if (next_look_ && *next_look_ <= now) next_look_.reset();
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
  void forget_directives() {
    forget_if<Directive>([](const Directive& /*directive*/) { return true; });
  }
  /// Forgets what of this kind is to happen to a drive.
  template <class Kind>
  void forget(int id) {
    forget_if<Kind>([id](const Kind& task) { return task.id == id; });
  }
  /// Forgets what of this kind is to happen because of a fault.
  template <class Kind>
  void forget_fault(std::size_t fault) {
    forget_if<Kind>([fault](const Kind& task) { return task.fault == fault; });
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
  void forget_if(const Which& which) {
    const auto meant = [&](const Entry& entry) {
      const auto* task = std::get_if<Kind>(&entry.task);
      return task != nullptr && which(*task);
    };
    if (std::erase_if(entries_, meant) > 0) std::ranges::make_heap(entries_, later);
  }

  std::vector<Entry> entries_;  // a heap, the next one first
  std::uint64_t entered_ = 0;
  std::optional<SimTime> next_look_;
};

}  // namespace lk::emulator
