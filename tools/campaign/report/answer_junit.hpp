#pragma once

#include <string>

#include "tools/campaign/report/answer.hpp"

namespace lk::emulator {

/// JUnit XML as CI systems read it: one test for each kind of fault. It fails where cases were
/// late, silently wrong, hung or crashed; it is an error where no fault of the kind took effect,
/// and skipped where the campaign has no result of the kind.
std::string answer_junit(const Answer& answer);

}  // namespace lk::emulator
