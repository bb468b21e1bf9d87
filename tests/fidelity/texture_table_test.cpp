#include "tests/fidelity/texture_table.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace lk::test {
namespace texture_table_test {

TEST(TextureTable, MatchesTheDocument) {
  std::ostringstream page;
  page << std::ifstream(LKEMU_SOURCE_DIR "/docs/internals/model.md").rdbuf();
  EXPECT_NE(page.str().find("<!-- begin texture -->\n" + texture_table() + "<!-- end texture -->"),
            std::string::npos)
      << "put what `fidelity_texture` prints between the markers";
}

}  // namespace texture_table_test
}  // namespace lk::test
