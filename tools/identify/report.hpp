#pragma once

#include <string>
#include <vector>

#include "tools/identify/identified.hpp"

namespace lk::emulator {

/// What the logs told, for a terminal: a table for each drive.
std::string identified_table_text(const IdentifiedDrive& drive);

/// One HTML file that needs nothing else: for each drive its values with intervals, the currents
/// that the balance expects over those of the log, what is left, moves emulated over those of the
/// log, and what to believe.
std::string identified_report(const std::vector<IdentifiedDrive>& drives,
                              const std::vector<std::string>& logs);

}  // namespace lk::emulator
