// docs/protocol.md §3 is what the table of the wire says.

#include "tools/formats/command_page.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace lk::formats {
namespace command_page_test {

TEST(Documents, TheCommandsAreThoseOfTheTable) {
  std::ostringstream text;
  text << std::ifstream(LKEMU_SOURCE_DIR "/docs/protocol.md").rdbuf();
  const std::string page = text.str();
  const std::string begin = "<!-- begin commands -->\n";
  const std::size_t first = page.find(begin);
  const std::size_t last = page.find("<!-- end commands -->");
  ASSERT_NE(first, std::string::npos);
  ASSERT_NE(last, std::string::npos);
  EXPECT_EQ(page.substr(first + begin.size(), last - first - begin.size()), command_page())
      << "put what build/release/emulator/lk-emu-formats prints between the markers";
}

TEST(Documents, TheCommandsOfRs485AreThoseOfTheTable) {
  std::ostringstream text;
  text << std::ifstream(LKEMU_SOURCE_DIR "/docs/rs485.md").rdbuf();
  const std::string page = text.str();
  const std::string begin = "<!-- begin commands -->\n";
  const std::size_t first = page.find(begin);
  const std::size_t last = page.find("<!-- end commands -->");
  ASSERT_NE(first, std::string::npos);
  ASSERT_NE(last, std::string::npos);
  EXPECT_EQ(page.substr(first + begin.size(), last - first - begin.size()), serial_command_page())
      << "put what build/release/emulator/lk-emu-formats --serial prints between the markers";
}

}  // namespace command_page_test
}  // namespace lk::formats
