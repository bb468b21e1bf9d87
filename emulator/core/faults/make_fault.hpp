#pragma once

/// @file Faults by the words of docs/reference/events.md, for C++ tests of hosts.

#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "emulator/core/fault.hpp"

namespace lk::emulator {

/// A parameter of a fault by its word: {"percent", 60}, {"frames", "both"}.
class FaultSetting {
 public:
  template <class Number>
  requires std::is_arithmetic_v<Number> FaultSetting(std::string_view word, Number number)
      : word_(word), value_(static_cast<double>(number)) {}
  FaultSetting(std::string_view word, std::string_view choice)
      : word_(word), value_(std::string(choice)) {}

  const std::string& word() const { return word_; }
  const std::variant<double, std::string>& value() const { return value_; }

 private:
  std::string word_;
  std::variant<double, std::string> value_;
};

/// Makes a fault of this kind for the drives `ids`, in any order; empty for a fault of the whole
/// bus. Missing parameters have their defaults. Set name, probability, duration and repetition in
/// the result. Throws std::invalid_argument with one line: the problem, and the allowed values.
Fault make_fault(std::string_view kind, const std::vector<FaultSetting>& settings = {},
                 std::vector<int> ids = {});

/// Returns in one line why no bus can have this fault; empty if a bus can. Does not check that the
/// drives exist, or that the fault can have an effect on them.
std::string fault_problem(const Fault& fault);

}  // namespace lk::emulator
