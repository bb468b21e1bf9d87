#pragma once

/// @file Faults as plain values: the request, and its outcome.

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

/// Shortest period of a recurring fault; with shorter periods, its beginnings would take most of
/// the computing time.
inline constexpr SimTime kMinFaultPeriod = std::chrono::milliseconds(1);

/// Index of a word in FaultParam::choices. The code of the fault casts it to an enumeration with
/// the same order.
enum class FaultChoice : std::uint8_t {};

/// Value of a fault parameter: a number in the parameter's unit, or a choice.
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
inline constexpr std::size_t kMaxFaultParams = 5;
using FaultValues = std::array<FaultValue, kMaxFaultParams>;

/// Request for a fault. It begins when its directive is executed; a trigger belongs to the
/// directive (TimedDirective).
struct Fault {
  std::string name;                 // unique on its bus
  const FaultRow* row = nullptr;    // kind, from fault_table(); never null on a bus
  std::vector<int> ids;             // affected drives, ascending; empty: the whole bus
  FaultValues values{};             // in the order and units of the row's parameters
  double probability = 1;           // per frame, for kinds that act on frames
  std::optional<SimTime> duration;  // of each occurrence, up to kLongestTime; absent: until cleared
  // Period of beginnings, above `duration`, at least kMinFaultPeriod; absent: one beginning.
  std::optional<SimTime> every;
  int times = 0;  // beginnings in total, with `every`; 0: unlimited
};

/// State of a fault and evidence of its effects.
struct FaultEvidence {
  enum class State : std::uint8_t { kArmed, kActive, kPaused, kOver, kCleared };
  State state = State::kArmed;
  SimTime armed_at{0};
  std::optional<SimTime> began_at;         // time of the first beginning
  std::optional<SimTime> first_effect_at;  // first difference from a run without the fault
  // Number of affected frames, of kicks and writes, or, for a lasting plant fault, of samples (one
  // per kSamplePeriod and drive) with a visible effect.
  std::uint64_t effects = 0;
  std::string first_on;  // object of the first effect: "drive 2", "drive 2, 142#9C…"
};

struct FaultReport {
  Fault fault;
  FaultEvidence evidence;
  std::size_t order = 0;  // number of faults armed on the bus before it
};

}  // namespace lk::emulator
