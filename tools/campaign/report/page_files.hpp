#pragma once

#include <string_view>

#include "emulator/files/embedded_file.hpp"

namespace lk::emulator {

/// A part of the page of an answer, by its path in the source: "/web/style.css"; null: there is no
/// such part.
const EmbeddedFile* find_page_file(std::string_view path);

}  // namespace lk::emulator
