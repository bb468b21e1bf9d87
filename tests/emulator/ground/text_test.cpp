#include "emulator/core/text.hpp"

#include <gtest/gtest.h>

namespace lk::emulator {
namespace text_test {

TEST(SanitizedLine, IsUtf8WithoutControlCharacters) {
  EXPECT_EQ(sanitized_line("a µ 电 😀"), "a µ 电 😀");
  EXPECT_EQ(sanitized_line("\x1b[2J\n\x7f"), "?[2J??");
  EXPECT_EQ(sanitized_line("\xC2\x9B"
                           "2J"),
            "??2J");                                           // 8-bit CSI
  EXPECT_EQ(sanitized_line("\xC0\x80\xFF\xE7\x94"), "?????");  // overlong, invalid byte, truncated
  EXPECT_EQ(sanitized_line("\xED\xA0\x80\xF4\x90\x80\x80"), "???????");  // surrogate, too large
  EXPECT_EQ(sanitized_line("\xEF\xBF\xBE\xEF\xBF\xBF"), "??????");       // U+FFFE, U+FFFF
}

/// "toml.exe" would be displayed as "exe.lmot".
TEST(SanitizedLine, ReplacesDirectionMarks) {
  for (const char* mark :
       {"\u061C", "\u200E", "\u200F", "\u2028", "\u2029", "\u202A", "\u202E", "\u2066", "\u2069"}) {
    EXPECT_EQ(sanitized_line(std::string("a") + mark + "b"),
              "a" + std::string(std::string_view(mark).size(), '?') + "b");
  }
  EXPECT_EQ(sanitized_line("שלום"), "שלום");
}

TEST(XmlEscaped, IsWellFormedForAnyText) {
  EXPECT_EQ(xml_escaped("<a b=\"c\">&amp;</a>\n"),
            "&lt;a b=&quot;c&quot;&gt;&amp;amp;&lt;/a&gt;&#10;");
  EXPECT_EQ(xml_escaped("\x1b\xFF\xEF\xBF\xBE\t"), "?????&#9;");
}

TEST(NumberOf, AcceptsOnlyDigitsUpToTheLimit) {
  EXPECT_EQ(number_of("0010", 10, 10), 10U);
  EXPECT_EQ(number_of("fF", 16, 255), 255U);
  EXPECT_EQ(number_of("18446744073709551615", 10, UINT64_MAX), UINT64_MAX);
  for (const char* text : {"", "11", "-1", "+1", " 1", "1 ", "1x", "18446744073709551616"}) {
    EXPECT_EQ(number_of(text, 10, 10), std::nullopt) << text;
  }
}

}  // namespace text_test
}  // namespace lk::emulator
