#include "emulator/core/language.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "emulator/core/start_error.hpp"
#include "tools/commands/arguments.hpp"

namespace lk::emulator {
namespace language_test {

TEST(Language, SelectsTheText) {
  const BilingualText brake{"brake", "抱闸"};
  EXPECT_EQ(brake.in(Language::kEnglish), "brake");
  EXPECT_EQ(brake.in(Language::kChinese), "抱闸");
}

TEST(Language, ComesFromTheFirstPartOfALocale) {
  EXPECT_EQ(language_of_locale("zh_CN.UTF-8"), Language::kChinese);
  EXPECT_EQ(language_of_locale("zh"), Language::kChinese);
  EXPECT_EQ(language_of_locale("zh@pinyin"), Language::kChinese);
  EXPECT_EQ(language_of_locale("C.UTF-8"), Language::kEnglish);
  EXPECT_EQ(language_of_locale("de_DE"), Language::kEnglish);
  EXPECT_EQ(language_of_locale("zhx_ZH"), Language::kEnglish);
}

TEST(Language, OptionOverridesTheLocale) {
  setenv("LC_ALL", "zh_CN.UTF-8", 1);
  EXPECT_EQ(chosen_language("en"), Language::kEnglish);
  setenv("LC_ALL", "C", 1);
  EXPECT_EQ(chosen_language("zh"), Language::kChinese);
  EXPECT_THROW(chosen_language("fr"), StartError);
}

TEST(Language, ComesFromTheFirstSetLocaleVariable) {
  setenv("LC_ALL", "", 1);
  setenv("LC_MESSAGES", "zh_TW.UTF-8", 1);
  setenv("LANG", "en_GB.UTF-8", 1);
  EXPECT_EQ(chosen_language(""), Language::kChinese);
  unsetenv("LC_MESSAGES");
  EXPECT_EQ(chosen_language(""), Language::kEnglish);
}

}  // namespace language_test
}  // namespace lk::emulator
