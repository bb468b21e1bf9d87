#pragma once

#include <string_view>

#include "emulator/files/profile_files.hpp"

namespace lk::emulator {

/// Returns the dashboard's file (web/) for a request target, ignoring its "?…"; null if there is
/// none.
/// "/" gives the page.
const EmbeddedFile* find_web_file(std::string_view target);

}  // namespace lk::emulator
