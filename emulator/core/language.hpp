#pragma once

#include <string_view>

namespace lk::emulator {

/// Language of text for users. Machine-readable output is the same in every language.
enum class Language { kEnglish, kChinese };

/// A text in both languages.
struct BilingualText {
  std::string_view en;
  std::string_view zh;

  constexpr std::string_view in(Language language) const {
    return language == Language::kChinese ? zh : en;
  }
};

}  // namespace lk::emulator
