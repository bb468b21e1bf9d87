// Limit on the nesting of tables by dotted keys.

#include <gtest/gtest.h>

#include <string>

#include "emulator/config/config_reader.hpp"

namespace lk::emulator {
namespace toml_depth_test {

std::string key_of(int parts) {
  std::string key = "a";
  for (int n = 1; n < parts; ++n) key += ".a";
  return key;
}

TEST(TomlDepth, CountsThePartsOfKeys) {
  EXPECT_FALSE(line_of_deep_key(""));
  EXPECT_FALSE(line_of_deep_key(key_of(kMaxKeyParts) + " = 1"));
  const std::string deep = key_of(kMaxKeyParts + 1);
  EXPECT_EQ(line_of_deep_key(deep + " = 1"), 1);
  EXPECT_EQ(line_of_deep_key("x = 1\n\n[" + deep + "]\n"), 3);
  EXPECT_EQ(line_of_deep_key("[[" + deep + "]]\n"), 1);
  EXPECT_EQ(line_of_deep_key("x = { y = 1, " + deep + " = 1 }"), 1);
  std::string spaced;
  for (int n = 0; n <= kMaxKeyParts; ++n) spaced += "\"a.=#\" . 'b' .\t";
  EXPECT_EQ(line_of_deep_key(spaced + "c = 1"), 1);
}

TEST(TomlDepth, IgnoresDotsOutsideKeys) {
  const std::string dots(1000, '.');
  std::string numbers = "x = [";
  for (int n = 0; n < 1000; ++n) numbers += "1.5, ";
  EXPECT_FALSE(line_of_deep_key(numbers + "]"));
  for (const std::string& text :
       {"x = \"" + dots + "\"", "x = '" + dots + "'", "x = '''\n" + dots + "\n'''",
        "x = \"\"\"\n\\\"" + dots + "\n\"\"\"", "# " + dots, R"(x = "\")" + dots + "\""}) {
    EXPECT_FALSE(line_of_deep_key(text)) << text;
  }
}

TEST(TomlDepth, FindsKeysAfterQuotes) {
  const std::string deep = key_of(kMaxKeyParts + 1) + " = 1";
  for (const char* before :
       {"x = \"\"\"a\"\"\"\"\"\n", R"(x = {y = """a"""", )", "x = ''\n", "x = \"\\\\\"\n",
        "'#' = 1\n", "x = \"#\"\n", "x = '\\'\n", "x = \"never closed\n"}) {
    EXPECT_TRUE(line_of_deep_key(before + deep)) << before;
  }
}

/// A megabyte of key parts would need a stack of 100 MB.
TEST(TomlDepth, IsCheckedBeforeParsing) {
  for (const std::string& text : {key_of(500'000) + " = 1", "[" + key_of(500'000) + "]"}) {
    try {
      parse_toml(text, "deep.toml");
      FAIL();
    } catch (const ConfigError& problem) {
      EXPECT_STREQ(problem.what(), "deep.toml:1: a key of more than 32 parts");
    }
  }
}

TEST(ConfigError, EscapesControlCharacters) {
  const ConfigError error("a.toml", 3, "b\nc", "\"\x1b[31m\r\" is not one of d");
  EXPECT_STREQ(error.what(), "a.toml:3: b?c: \"?[31m?\" is not one of d");
}

}  // namespace toml_depth_test
}  // namespace lk::emulator
