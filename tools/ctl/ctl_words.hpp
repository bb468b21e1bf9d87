#pragma once

#include <string>
#include <vector>

#include "emulator/files/json_table.hpp"

namespace lk::emulator {

/// Puts "KEY=VALUE" into `object`: numbers, true and false are such, JSON in brackets too, all else
/// is text. "load.J_g_cm2=100" is a key in an object. Throws StartError.
void put_word(Json& object, const std::string& word);

/// "10ms", "1.5s", "250us", "2min"; a number alone is in seconds. Throws StartError.
double parse_span_s(const std::string& text);

}  // namespace lk::emulator
