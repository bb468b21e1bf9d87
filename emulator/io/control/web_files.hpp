#pragma once

#include <string_view>

#include "emulator/files/profile_files.hpp"

namespace lk::emulator {

/// Returns the dashboard file (web/) for `target`, which may have a "?…"; null if there is none.
/// "/" is the page.
const EmbeddedFile* find_web_file(std::string_view target);

}  // namespace lk::emulator
