#pragma once

#include <string>

#include "emulator/core/faults/fault_table.hpp"

namespace lk::emulator {

/// Returns all faults as a table (`lk-emu faults`).
std::string list_faults();
/// Returns one fault with its parameters and an example (`lk-emu faults jam`).
std::string describe_fault(const FaultRow& row);
/// Returns the generated part of docs/reference/events.md, as Markdown.
std::string fault_page();

}  // namespace lk::emulator
