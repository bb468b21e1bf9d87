#include "tools/plot/svg_text.hpp"

#include <algorithm>
#include <string_view>

#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

unsigned byte(char c) { return static_cast<unsigned char>(c); }

/// The length of the UTF-8 character that the text begins with (RFC 3629, section 4); 0: none that
/// XML and a picture can have.
std::size_t character_length(std::string_view text) {
  const unsigned first = byte(text[0]);
  if (first < 0x80) return first >= 0x20 && first != 0x7F ? 1 : 0;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return 0;
  for (std::size_t n = 1; n < length; ++n) {
    if ((byte(text[n]) & 0xC0U) != 0x80) return 0;
  }
  const unsigned second = byte(text[1]);
  const bool control = first == 0xC2 && second < 0xA0;
  const bool overlong = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90);
  const bool surrogate = first == 0xED && second >= 0xA0;
  const bool too_large = first == 0xF4 && second >= 0x90;
  const bool no_character = first == 0xEF && second == 0xBF && byte(text[2]) >= 0xBE;
  return control || overlong || surrogate || too_large || no_character ? 0 : length;
}

constexpr double kWide_em = 1;

double width_em(std::string_view character) {
  constexpr std::string_view kNarrow = " !'(),-./:;I[]fijlrt|";
  constexpr std::string_view kWide = "#%&+<=>@MW^mw~";
  if (character.size() == 1 && kNarrow.find(character) != std::string_view::npos) return 0.42;
  if (character.size() == 1 && kWide.find(character) != std::string_view::npos) return kWide_em;
  // U+1100 is where the scripts of East Asia begin, and E1 84 80 in UTF-8.
  return character >= "\xE1\x84" ? kWide_em : 0.66;
}

/// Takes the first character off a text; "?" in place of a byte that is not part of one.
std::string_view next_character(std::string_view& rest) {
  const std::size_t length = character_length(rest);
  const std::string_view character = length == 0 ? "?" : rest.substr(0, length);
  rest.remove_prefix(std::max<std::size_t>(length, 1));
  return character;
}

}  // namespace

std::string printable_text(const std::string& text) {
  std::string out;
  for (std::string_view rest = text; !rest.empty();) out += next_character(rest);
  return out;
}

std::string xml_text(const std::string& text) { return xml_escaped(printable_text(text)); }

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
