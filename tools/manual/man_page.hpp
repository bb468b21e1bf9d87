#pragma once

#include <string>

#include "tools/manual/word.hpp"

namespace lk::manual {

/// lk-emu(1), for man. `date` as it stands at the foot of each page: "2026-01-31".
std::string man_page(const Word& program, const std::string& date);

}  // namespace lk::manual
