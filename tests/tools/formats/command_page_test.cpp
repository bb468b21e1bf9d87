// docs/reference/protocol.md §3 agrees with the table of commands.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tools/formats/formats.hpp"

namespace lk::formats {
namespace command_page_test {

/// Returns the text between the markers of this name in the document.
std::string block(const std::string& file, const std::string& name) {
  std::ostringstream text;
  text << std::ifstream(LKEMU_SOURCE_DIR "/docs/" + file).rdbuf();
  const std::string page = text.str();
  const std::string begin = "<!-- begin " + name + " -->\n";
  const std::size_t first = page.find(begin);
  const std::size_t last = page.find("<!-- end " + name + " -->");
  if (first == std::string::npos || last == std::string::npos) return "no such block";
  return page.substr(first + begin.size(), last - first - begin.size());
}

TEST(Documents, CommandsMatchTheTable) {
  EXPECT_EQ(block("reference/protocol.md", "commands"), command_page())
      << "put what build/release/emulator/lk-emu-formats prints between the markers";
}

TEST(Documents, Rs485CommandsMatchTheTable) {
  EXPECT_EQ(block("reference/rs485.md", "commands"), serial_command_page())
      << "put what build/release/emulator/lk-emu-formats --serial prints between the markers";
}

TEST(Documents, GenerationsMatchTheTable) {
  EXPECT_EQ(block("reference/protocol.md", "generations"), generation_page())
      << "put what build/release/emulator/lk-emu-formats --generations prints between the markers";
}

}  // namespace command_page_test
}  // namespace lk::formats
