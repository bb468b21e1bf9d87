// The table of docs/guides/host-mistakes.md agrees with the program's.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "emulator/monitor/advice/advice.hpp"

namespace lk::emulator {
namespace advice_documents_test {

std::string document(const std::string& name) {
  std::ostringstream text;
  text << std::ifstream(LKEMU_SOURCE_DIR "/docs/" + name).rdbuf();
  return text.str();
}

void expect_the_table(const std::string& text) {
  for (const AdviceRow& row : advice_table()) {
    const std::string word(row.word);
    const std::string begin = "\n| `" + word + "` | " + std::string(row.rule.en) + " | ";
    const std::size_t at = text.find(begin);
    ASSERT_NE(at, std::string::npos) << begin;
    const std::size_t source = at + begin.size();
    const std::string end = " | " + std::string(row.todo.en) + " |\n";
    const std::size_t line_end = text.find('\n', source);
    const std::size_t source_end = text.find(end, source);
    EXPECT_LT(source_end, line_end) << word << ": " << end;
    EXPECT_GT(source_end, source) << word << " says where its thresholds come from";
  }
}

TEST(AdviceDocuments, MatchTheTableInTheCode) {
  const std::string english = document("guides/host-mistakes.md");
  expect_the_table(english);
  std::size_t rows = 0;
  for (std::size_t at = english.find("| what to do |"); at != std::string::npos;
       at = english.find("\n| `", at + 1)) {
    ++rows;
  }
  EXPECT_EQ(rows, 1 + kAdviceKinds) << "and no others";
}

TEST(AdviceDocuments, ListEachKindInOrder) {
  ASSERT_EQ(advice_table().size(), kAdviceKinds);
  for (std::size_t n = 0; n < kAdviceKinds; ++n) {
    const AdviceRow& row = advice_table()[n];
    EXPECT_EQ(static_cast<std::size_t>(row.kind), n);
    EXPECT_EQ(&advice_row(row.kind), &row);
    EXPECT_FALSE(row.todo.zh.empty());
  }
}

}  // namespace advice_documents_test
}  // namespace lk::emulator
