#pragma once

/// @file Faults by the words of docs/faults.md, for tests of hosts in C++.

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

/// A fault of this kind at the drives `ids`, in any order; none for a fault of the bus as a whole.
/// Parameters that `settings` leaves out have their defaults; name, probability and course are
/// members of the result. Throws std::invalid_argument with one line: what is wrong, and what is
/// allowed.
Fault make_fault(std::string_view kind, const std::vector<FaultSetting>& settings = {},
                 std::vector<int> ids = {});

/// Why no bus can have this fault, in one line; empty when one can. Whether its drives are there,
/// and whether it could ever show on them, is not looked at.
std::string fault_problem(const Fault& fault);

}  // namespace lk::emulator
