#include <gtest/gtest.h>

#include "tools/ctl/ctl_watch.hpp"

namespace lk::emulator {
namespace ctl_words_test {

TEST(CtlWords, BecomeJson) {
  Json said = Json::object();
  for (const char* word : {"ids=1", "supply_V=18", "load.J_g_cm2=1.5", "load.tau_gravity_Nm=-2",
                           "on=true", "command=0xA4", "list=[1,2]"}) {
    put_word(said, word);
  }
  EXPECT_EQ(said, Json::parse(R"({"ids":"1","supply_V":18,
      "load":{"J_g_cm2":1.5,"tau_gravity_Nm":-2},"on":true,"command":"0xA4","list":[1,2]})"));
  EXPECT_ANY_THROW(put_word(said, "supply_V=1"));
  EXPECT_ANY_THROW(put_word(said, "supply_V.x=1"));
  EXPECT_ANY_THROW(put_word(said, "=1"));
  EXPECT_ANY_THROW(put_word(said, "word"));
  EXPECT_ANY_THROW(put_word(said, "other={"));
}

TEST(CtlWords, ParseSpansWithUnits) {
  EXPECT_DOUBLE_EQ(parse_span_s("10ms"), 0.01);
  EXPECT_DOUBLE_EQ(parse_span_s("1.5"), 1.5);
  EXPECT_DOUBLE_EQ(parse_span_s("2min"), 120);
  EXPECT_DOUBLE_EQ(parse_span_s("250us"), 0.00025);
  for (const char* wrong : {"", "ms", "-1s", "1 s", "1fortnight", "nan"}) {
    EXPECT_ANY_THROW(parse_span_s(wrong)) << wrong;
  }
}

}  // namespace ctl_words_test
}  // namespace lk::emulator
