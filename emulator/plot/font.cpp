#include "emulator/plot/font.hpp"

#include <cairo-ft.h>
#include <fontconfig/fontconfig.h>

#include <memory>
#include <stdexcept>

namespace lk::emulator {
namespace {

template <auto destroy>
struct Destroy {
  template <class T>
  void operator()(T* thing) const {
    destroy(thing);
  }
};
using Pattern = std::unique_ptr<FcPattern, Destroy<FcPatternDestroy>>;
using FontSet = std::unique_ptr<FcFontSet, Destroy<FcFontSetDestroy>>;
using FontFace = std::unique_ptr<cairo_font_face_t, Destroy<cairo_font_face_destroy>>;

const FcChar8* fc(const char* text) { return reinterpret_cast<const FcChar8*>(text); }

/// What is looked for. Not the locale's language: the same picture for everybody.
Pattern wanted() {
  Pattern pattern(FcPatternCreate());
  FcPatternAddString(pattern.get(), FC_FAMILY, fc("DejaVu Sans"));
  FcPatternAddString(pattern.get(), FC_FAMILY, fc("sans-serif"));
  FcPatternAddString(pattern.get(), FC_LANG, fc("en"));
  FcConfigSubstitute(nullptr, pattern.get(), FcMatchPattern);
  FcDefaultSubstitute(pattern.get());
  return pattern;
}

FontSet fonts_by_nearness(FcPattern* pattern) {
  FcResult result = FcResultMatch;
  return FontSet(FcFontSort(nullptr, pattern, FcFalse, nullptr, &result));
}

bool can_write(const FcPattern* font, const std::string& text) {
  FcBool outline = FcFalse;
  FcPatternGetBool(font, FC_OUTLINE, 0, &outline);
  FcCharSet* characters = nullptr;
  if (outline == FcFalse ||
      FcPatternGetCharSet(font, FC_CHARSET, 0, &characters) != FcResultMatch) {
    return false;
  }
  const FcChar8* at = fc(text.c_str());
  int left = static_cast<int>(text.size());
  while (left > 0) {
    FcChar32 character = 0;
    const int length = FcUtf8ToUcs4(at, &character, left);
    if (length <= 0 || FcCharSetHasChar(characters, character) == FcFalse) return false;
    at += length;
    left -= length;
  }
  return true;
}

/// Null: none of them.
FcPattern* first_that_can_write(const FcFontSet* fonts, const std::string& text) {
  for (int n = 0; fonts != nullptr && n < fonts->nfont; ++n) {
    if (can_write(fonts->fonts[n], text)) return fonts->fonts[n];
  }
  return nullptr;
}

}  // namespace

bool font_has(const std::string& text) {
  const Pattern pattern = wanted();
  return first_that_can_write(fonts_by_nearness(pattern.get()).get(), text) != nullptr;
}

void set_font(cairo_t* cairo, const std::string& text) {
  const Pattern pattern = wanted();
  const FontSet fonts = fonts_by_nearness(pattern.get());
  FcPattern* font = first_that_can_write(fonts.get(), text);
  if (font == nullptr) font = first_that_can_write(fonts.get(), "0123456789");
  if (font == nullptr)
    throw std::runtime_error("this machine has no font: install fonts-dejavu-core");
  const Pattern complete(FcFontRenderPrepare(nullptr, pattern.get(), font));
  const FontFace face(cairo_ft_font_face_create_for_pattern(complete.get()));
  cairo_set_font_face(cairo, face.get());
  // Outlines as they are, whatever screen this machine has.
  const std::unique_ptr<cairo_font_options_t, Destroy<cairo_font_options_destroy>> options(
      cairo_font_options_create());
  cairo_font_options_set_antialias(options.get(), CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(cairo, options.get());
}

}  // namespace lk::emulator
