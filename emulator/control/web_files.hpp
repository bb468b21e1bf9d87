#pragma once

#include <string_view>

#include "emulator/files/embedded_file.hpp"

namespace lk::emulator {

/// A file of the dashboard (web/): what a browser asks for by `target`, which may have a "?…";
/// null: there is none. "/" is the page.
const EmbeddedFile* find_web_file(std::string_view target);

}  // namespace lk::emulator
