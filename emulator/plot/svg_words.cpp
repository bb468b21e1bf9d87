#include "emulator/plot/svg_words.hpp"

#include <string_view>

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

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else {
      out += c;
    }
  }
  return out;
}

std::string description(const Picture& picture) {
  std::string text;
  for (const std::string& drive : picture.drives) text += (text.empty() ? "" : ", ") + drive;
  for (const PlotPanel& panel : picture.panels) {
    text += (text.empty() ? "" : "; ");
    if (!panel.missing.empty()) text += panel.missing;
    if (panel.left) text += panel.left->title;
    if (panel.left && panel.right) text += ", ";
    if (panel.right) text += panel.right->title;
  }
  return text;
}

}  // namespace

std::string printable_text(const std::string& text) {
  std::string out;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t length = character_length(rest);
    out += length == 0 ? "?" : rest.substr(0, length);
    rest.remove_prefix(length == 0 ? 1 : length);
  }
  return out;
}

void add_words(std::string& svg, const Picture& picture) {
  const std::size_t begin = svg.find("<svg ");
  const std::size_t end = svg.find('>', begin);
  if (begin == std::string::npos || end == std::string::npos) return;
  svg.insert(end + 1, "\n<title>" + escaped(picture.title) + "</title>\n<desc>" +
                          escaped(description(picture)) + "</desc>");
  svg.insert(begin + 5, "role=\"img\" ");
}

}  // namespace lk::emulator
