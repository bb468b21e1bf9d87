#include "tools/plot/svg_text.hpp"

#include <algorithm>
#include <string_view>

#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

constexpr double kWide_em = 1;

double width_em(std::string_view character) {
  constexpr std::string_view kNarrow = " !'(),-./:;I[]fijlrt|";
  constexpr std::string_view kWide = "#%&+<=>@MW^mw~";
  if (character.size() == 1 && kNarrow.find(character) != std::string_view::npos) return 0.42;
  if (character.size() == 1 && kWide.find(character) != std::string_view::npos) return kWide_em;
  // U+1100 is where the scripts of East Asia begin, and E1 84 80 in UTF-8.
  return character >= "\xE1\x84" ? kWide_em : 0.66;
}

}  // namespace

double assumed_width_px(const std::string& text, double size_px) {
  double width = 0;
  for (std::string_view rest = text; !rest.empty();) width += width_em(next_character(rest));
  return width * size_px;
}

FittedText fit_text(const std::string& text, double size_px, double width_px) {
  constexpr double kLeast_px = 8;  // assumed: smaller is not readable
  const double wanted_px = assumed_width_px(text, size_px);
  if (wanted_px <= width_px) return {text, size_px};
  FittedText fitted{"", std::max(kLeast_px, size_px * width_px / wanted_px)};
  if (fitted.size_px > kLeast_px) return {text, fitted.size_px};
  double left_px = width_px - kWide_em * fitted.size_px;  // the ellipsis
  for (std::string_view rest = text; !rest.empty();) {
    const std::string_view character = next_character(rest);
    left_px -= width_em(character) * fitted.size_px;
    if (left_px < 0) break;
    fitted.text += character;
  }
  fitted.text += "…";
  return fitted;
}

}  // namespace lk::emulator
