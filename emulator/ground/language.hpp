#pragma once

#include <string_view>

namespace lk::emulator {

/// What words for people are written in. Machine-readable output is the same in every language.
enum class Language { kEnglish, kChinese };

/// The same words in both languages.
struct Words {
  std::string_view en;
  std::string_view zh;

  constexpr std::string_view in(Language language) const {
    return language == Language::kChinese ? zh : en;
  }
};

}  // namespace lk::emulator
