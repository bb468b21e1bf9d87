#pragma once

#include <string>

#include "emulator/plot/picture.hpp"

namespace lk::emulator {

/// A text of anybody's as UTF-8 without control characters; what is neither becomes a question
/// mark.
std::string printable_text(const std::string& text);

/// Gives an SVG, in which text is but outlines, a title and a description that programs can read
/// out and search.
void add_words(std::string& svg, const Picture& picture);

}  // namespace lk::emulator
