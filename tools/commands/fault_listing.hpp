#pragma once

#include <string>

#include "emulator/core/faults/fault_table.hpp"

namespace lk::emulator {

/// All faults as a table for a person (`lk-emu faults`).
std::string list_faults();
/// One fault, with its parameters and an example (`lk-emu faults jam`).
std::string describe_fault(const FaultRow& row);
/// The page docs/faults.md, as Markdown.
std::string fault_page();

}  // namespace lk::emulator
