#pragma once

/// @file Faults as plain values: what is injected, and what came of it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

struct FaultRow;

inline constexpr int kWholeBus = 0;  // in place of a drive's ID

/// The shortest time between two beginnings of a fault: with a shorter one it takes all the time of
/// a run.
inline constexpr SimTime kClosestFaults = std::chrono::milliseconds(1);

/// A word of those that a parameter offers, by its place among them; whoever acts on it has an
/// enumeration in the same order.
enum class FaultChoice : std::uint8_t {};

/// What a parameter of a fault is set to: a number in the parameter's unit, or a word.
class FaultValue {
 public:
  constexpr FaultValue(double number = 0) : value_(number) {}
  template <class Choice>
  requires std::is_enum_v<Choice>
  constexpr FaultValue(Choice choice) : value_(static_cast<FaultChoice>(choice)) {}

  constexpr bool is_number() const { return std::holds_alternative<double>(value_); }
  constexpr double number() const { return std::get<double>(value_); }
  template <class Choice = FaultChoice>
  constexpr Choice choice() const {
    return static_cast<Choice>(std::get<FaultChoice>(value_));
  }
  friend bool operator==(const FaultValue&, const FaultValue&) = default;

 private:
  std::variant<double, FaultChoice> value_;
};
inline constexpr std::size_t kMostFaultParams = 5;
using FaultValues = std::array<FaultValue, kMostFaultParams>;

/// A fault as it is asked for. It begins when its directive is performed; a trigger is the
/// directive's (TimedDirective).
struct Fault {
  std::string name;                 // tells it from the others of its bus
  const FaultRow* row = nullptr;    // its kind, one of fault_table(); never null on a bus
  std::vector<int> ids;             // the drives that have it, ascending; empty: the bus as a whole
  FaultValues values{};             // in the order and the units of the row's parameters
  double probability = 1;           // of each frame, for kinds that act on frames
  std::optional<SimTime> duration;  // of each time, up to kLongestTime; absent: until it is cleared
  // From one beginning to the next, longer than `duration`, at least kClosestFaults; absent: once.
  std::optional<SimTime> every;
  int times = 0;  // beginnings in all, with `every`; 0: no end
};

/// What has become of a fault.
struct FaultEvidence {
  enum class State : std::uint8_t { kArmed, kActive, kPaused, kOver, kCleared };
  State state = State::kArmed;
  SimTime armed_at{0};
  std::optional<SimTime> began_at;         // first
  std::optional<SimTime> first_effect_at;  // something was otherwise than without the fault
  // Frames; kicks and writes; of what lasts, the instants of looking (Bus::kLookStep) at which it
  // showed, of each drive. 0: none.
  std::uint64_t effects = 0;
  std::string first_on;  // what the first effect was on: "drive 2", "drive 2, 142#9C…"
};

struct FaultReport {
  Fault fault;
  FaultEvidence evidence;
  std::size_t order = 0;  // so many were armed on the bus before it
};

}  // namespace lk::emulator
