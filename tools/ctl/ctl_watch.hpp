#pragma once

#include <string>
#include <vector>

#include "emulator/files/json_table.hpp"
#include "tools/ctl/ctl_client.hpp"

namespace lk::emulator {

/// Inserts "KEY=VALUE" into `object`. VALUE is a number, true, false, JSON in brackets, or else
/// text. "load.J_g_cm2=100" sets a key of the nested object `load`. Throws StartError.
void put_word(Json& object, const std::string& word);

/// Returns the duration in "10ms", "1.5s", "250us", "2min", in s; the default unit is seconds.
/// Throws StartError.
double parse_span_s(const std::string& text);

/// Shows the drives and updates the display until q or Ctrl-C. Without a terminal, prints the
/// drives once. Returns the exit status.
int watch_drives(const CtlClient& client);

}  // namespace lk::emulator
