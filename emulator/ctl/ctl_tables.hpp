#pragma once

#include <string>

#include "emulator/control/json_table.hpp"

namespace lk::emulator {

// Answers of the control interface, for a person.
std::string status_table(const Json& status);
std::string drives_table(const Json& drives);
std::string drive_page(const Json& drive);
std::string faults_table(const Json& faults);
std::string advice_table_en(const Json& advice);
std::string advice_table_zh(const Json& advice);

}  // namespace lk::emulator
