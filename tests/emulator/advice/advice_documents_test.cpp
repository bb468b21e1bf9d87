// The table of docs/guides/host-mistakes.md agrees with the program's.

#include <gtest/gtest.h>

#include "emulator/files/output_file.hpp"
#include "emulator/monitor/advice/advice.hpp"

namespace lk::emulator {
namespace advice_documents_test {

TEST(AdviceDocuments, MatchTheTableInTheCode) {
  const std::string text =
      read_regular_file(LKEMU_SOURCE_DIR "/docs/guides/host-mistakes.md", kLongestText);
  for (const AdviceRow& row : advice_table()) {
    const std::string word(row.word);
    const std::string begin = "\n| `" + word + "` | " + std::string(row.rule.en) + " | ";
    const std::size_t at = text.find(begin);
    ASSERT_NE(at, std::string::npos) << begin;
    const std::size_t source = at + begin.size();
    const std::string end = " | " + std::string(row.todo.en) + " |\n";
    const std::size_t source_end = text.find(end, source);
    EXPECT_LT(source_end, text.find('\n', source)) << word << ": " << end;
    EXPECT_GT(source_end, source) << word << " says where its thresholds come from";
  }
  std::size_t rows = 0;
  for (std::size_t at = text.find("| what to do |"); at != std::string::npos;
       at = text.find("\n| `", at + 1)) {
    ++rows;
  }
  EXPECT_EQ(rows, 1 + kAdviceKinds) << "and no others";
}

}  // namespace advice_documents_test
}  // namespace lk::emulator
