// Options of lk-emu ctl and their positions.

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>

#include "tools/commands/commands.hpp"

namespace lk::emulator {
namespace ctl_options_test {

void parse(const std::string& line) { declare(*find_command("ctl")).app->parse(line); }

TEST(CtlOptions, AcceptOptionsAndWordsInTheirPlaces) {
  for (const char* const line :
       {"--lang zh advice", "advice --lang zh", "--json --lang en status",
        "send position_2 angle_deg=90 --ids 1-4", "send 141#9C00000000000000", "wait --for 10s"}) {
    EXPECT_NO_THROW(parse(line)) << line;
  }
  EXPECT_THROW(parse("send"), CLI::ParseError);
}

}  // namespace ctl_options_test
}  // namespace lk::emulator
