#pragma once

#include <string>

#include "tools/guess/guesser.hpp"

namespace lk::emulator {

/// Returns the findings as JSON: a line for each drive, then the summary.
std::string guess_json(const Guesser& guesser);

}  // namespace lk::emulator
