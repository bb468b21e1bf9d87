// Words for people, in two languages.

#include "emulator/core/language.hpp"

#include <gtest/gtest.h>

namespace lk::emulator {
namespace {

TEST(Words, AreInTheLanguageThatIsAskedFor) {
  const Words brake{"brake", "抱闸"};
  EXPECT_EQ(brake.in(Language::kEnglish), "brake");
  EXPECT_EQ(brake.in(Language::kChinese), "抱闸");
}

}  // namespace
}  // namespace lk::emulator
