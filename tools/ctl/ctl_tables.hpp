#pragma once

#include <string>

#include "emulator/files/json_table.hpp"

namespace lk::emulator {

// Answers of the control interface, for a person.
std::string status_table(const Json& status);
std::string drives_table(const Json& drives);
std::string drive_page(const Json& drive);
std::string faults_table(const Json& faults);
/// A recording that has begun, and one that has ended.
std::string recording_line(const Json& recording);
std::string recorded_line(const Json& recording);
/// How a scenario stands, and what came of it so far.
std::string scenario_page(const Json& scenario);
std::string advice_table_en(const Json& advice);
std::string advice_table_zh(const Json& advice);

}  // namespace lk::emulator
