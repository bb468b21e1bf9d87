#pragma once

#include <string_view>

namespace lk::emulator {

/// plan_body.py: what the script of a plan does with its constants.
std::string_view plan_body();

}  // namespace lk::emulator
