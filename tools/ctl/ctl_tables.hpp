#pragma once

#include <string>

#include "emulator/files/json_table.hpp"

namespace lk::emulator {

// Format answers of the control interface as text.
std::string status_table(const Json& status);
std::string drives_table(const Json& drives);
std::string drive_page(const Json& drive);
std::string faults_table(const Json& faults);
/// Describe a started and a finished recording.
std::string recording_line(const Json& recording);
std::string recorded_line(const Json& recording);
/// Describes the state of a scenario, and its results so far.
std::string scenario_page(const Json& scenario);
std::string advice_table_en(const Json& advice);
std::string advice_table_zh(const Json& advice);

}  // namespace lk::emulator
