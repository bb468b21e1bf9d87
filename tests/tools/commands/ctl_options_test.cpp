// Options of lk-emu ctl and their positions.

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>

#include "tools/commands/commands.hpp"

namespace lk::emulator {
namespace ctl_options_test {

/// A global option may precede or follow the subcommand.
TEST(CtlOptions, AcceptLanguageBeforeTheCommand) {
  for (const char* const line :
       {"--lang zh advice", "advice --lang zh", "--json --lang en status"}) {
    EXPECT_NO_THROW(ctl_app()->parse(std::string(line))) << line;
  }
}

TEST(CtlOptions, AcceptWordsAfterSend) {
  EXPECT_NO_THROW(ctl_app()->parse(std::string("send position_2 angle_deg=90 --ids 1-4")));
  EXPECT_NO_THROW(ctl_app()->parse(std::string("send 141#9C00000000000000")));
  EXPECT_NO_THROW(ctl_app()->parse(std::string("wait --for 10s")));
  EXPECT_THROW(ctl_app()->parse(std::string("send")), CLI::ParseError);
}

}  // namespace ctl_options_test
}  // namespace lk::emulator
