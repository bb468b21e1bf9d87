#pragma once

#include <cairo.h>

#include <string>

namespace lk::emulator {

/// Whether one font of this machine has all characters of a text.
bool font_has(const std::string& text);

/// Sets a font that has all characters of the text, as far as there is one: DejaVu Sans or the
/// machine's own sans-serif, else the first that can. Throws std::runtime_error when there is no
/// font.
void set_font(cairo_t* cairo, const std::string& text);

}  // namespace lk::emulator
