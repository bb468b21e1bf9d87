#pragma once

#include <string>

#include "tools/plot/picture.hpp"

namespace lk::emulator {

/// The picture as an SVG file (SVG 1.1, UTF-8), 1100 px wide, with a title and a description for
/// screen readers and search. The same picture gives the same bytes on every machine.
std::string to_svg(const Picture& picture);

}  // namespace lk::emulator
