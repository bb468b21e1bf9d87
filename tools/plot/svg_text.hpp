#pragma once

#include <string>

namespace lk::emulator {

/// How wide a text is, in px, at a font size of `size_px`. Assumed, since the font that shows it is
/// not known: characters are narrow (0.42 em), wide (1 em, those of East Asia too) or as most
/// (0.66 em). DejaVu Sans, one of the widest fonts there are, keeps to that but for some capitals.
double assumed_width_px(const std::string& text, double size_px);

struct FittedText {
  std::string text;
  double size_px;
};

/// A text of at most `width_px`: smaller, down to 8 px, and then cut short with an ellipsis.
FittedText fit_text(const std::string& text, double size_px, double width_px);

}  // namespace lk::emulator
