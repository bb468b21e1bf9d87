// Standard output that cannot be written, or has no reader.

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "tests/host/emulator_process.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::host {
namespace output_test {

/// Returns a launcher that redirects standard output.
std::vector<std::string> with_output(const std::string& redirection) {
  return {"sh", "-c", redirection, "sh"};
}

TEST(Output, FailsOnAFullDevice) {
  for (const std::vector<std::string>& command : {std::vector<std::string>{"motors"},
                                                  {"motors", "mf7015"},
                                                  {"faults"},
                                                  {"--check", "--bus", "vcan0", "--ids", "1"},
                                                  {"--version"},
                                                  {"ctl", "--help"}}) {
    const auto result = EmulatorProcess(command, with_output("exec \"$@\" >/dev/full")).wait();
    EXPECT_EQ(result.status, 1) << command[0];
    EXPECT_EQ(result.err.rfind("lk-emu: standard output: ", 0), 0U) << result.err;
    EXPECT_EQ(result.err.find('\n'), result.err.size() - 1) << result.err;
  }
}

TEST(Output, IgnoresAClosedReader) {
  const test::TempDirectory own;
  const std::string fifo = own.path("fifo");
  // The reader has exited before any output.
  const std::string left = "mkfifo " + fifo + " && exec 3<>" + fifo + " && exec 4>" + fifo +
                           " && rm " + fifo + " && exec 3<&- && exec \"$@\" >&4 4>&-";
  for (const std::string& redirection : {left, std::string("exec \"$@\" >&-")}) {
    for (const char* command : {"motors", "faults"}) {
      const auto result = EmulatorProcess({command}, with_output(redirection)).wait();
      EXPECT_EQ(result.status, 0) << redirection;
      EXPECT_EQ(result.err, "") << redirection;
    }
  }
}

TEST(Output, ClosedDescriptorsAreNotReused) {
  const test::TempDirectory own;
  const std::string junit = own.path("junit.xml");
  const auto result =
      EmulatorProcess(
          {"run", LKEMU_SOURCE_DIR "/configs/scenarios/duplicate_id.toml", "--junit", junit},
          with_output("exec \"$@\" >&- 2>&- <&-"))
          .wait();
  EXPECT_EQ(result.status, 0);
  std::ifstream file(junit);
  std::string first;
  std::getline(file, first);
  EXPECT_EQ(first.rfind("<?xml ", 0), 0U) << first;
}

}  // namespace output_test
}  // namespace lk::host
