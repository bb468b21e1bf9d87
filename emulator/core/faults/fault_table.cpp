#include "emulator/core/faults/fault_table.hpp"

#include <algorithm>
#include <vector>

#include "emulator/core/faults/fault_rows.hpp"

namespace lk::emulator {

std::string_view to_string(FaultGroup group) {
  switch (group) {
    case FaultGroup::kLink:
      return "link";
    case FaultGroup::kSensors:
      return "sensors";
    case FaultGroup::kPowerStage:
      return "power stage";
    case FaultGroup::kMechanics:
      return "mechanics";
    case FaultGroup::kPower:
      return "power";
    case FaultGroup::kFirmware:
      return "firmware and memory";
  }
  return "";
}

std::span<const FaultRow> fault_table() {
  static const std::vector<FaultRow> table = [] {
    std::vector<FaultRow> all;
    for (const auto rows :
         {link_faults(), adapter_faults(), serial_faults(), plant_faults(), firmware_faults()}) {
      all.insert(all.end(), rows.begin(), rows.end());
    }
    return all;
  }();
  return table;
}

const FaultRow* find_fault(std::string_view word) {
  const auto found = std::ranges::find(fault_table(), word, &FaultRow::word);
  return found != fault_table().end() ? &*found : nullptr;
}

Fault fault_of(const FaultRow& row) {
  Fault fault;
  fault.row = &row;
  std::ranges::transform(row.params, fault.values.begin(), &FaultParam::fallback);
  return fault;
}

}  // namespace lk::emulator
