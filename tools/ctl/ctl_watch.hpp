#pragma once

#include <string>
#include <vector>

#include "emulator/files/json_table.hpp"
#include "tools/ctl/ctl_client.hpp"

namespace lk::emulator {

/// Puts "KEY=VALUE" into `object`: a number, true, false, JSON in brackets, or else text.
/// "load.J_g_cm2=100" sets a key in a nested object. Throws StartError.
void put_word(Json& object, const std::string& word);

/// Parses "10ms", "1.5s", "250us", "2min"; the default unit is seconds. Throws StartError.
double parse_span_s(const std::string& text);

/// Shows the drives repeatedly until q or Ctrl-C; once if standard output is no terminal. Returns
/// the exit status.
int watch_drives(const CtlClient& client);

}  // namespace lk::emulator
