#pragma once

/// @file Faults by the names of the table, for tests.

#include <algorithm>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/core/faults/fault_table.hpp"

namespace lk::test {

/// Returns a fault of the kind `word`; missing parameters get the table's defaults.
inline emulator::Fault fault_of(std::string_view word,
                                std::initializer_list<emulator::FaultValue> values = {},
                                std::vector<int> ids = {}) {
  const emulator::FaultRow* const row = emulator::find_fault(word);
  if (row == nullptr) throw std::invalid_argument("no fault " + std::string(word));
  emulator::Fault fault = emulator::fault_of(*row);
  std::ranges::copy(values, fault.values.begin());
  fault.ids = std::move(ids);
  return fault;
}

}  // namespace lk::test
