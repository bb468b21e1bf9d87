#include "emulator/program/profile_files.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <stdexcept>
#include <string>

#include "tests/support/temp_directory.hpp"

namespace lk::emulator {
namespace profile_files_test {

std::string refusal(const std::string& file, std::uintmax_t longest) {
  try {
    read_regular_file(file, longest);
  } catch (const std::invalid_argument& problem) {
    return problem.what();
  }
  return "";
}

TEST(RegularFile, IsReadUpToItsLimit) {
  const test::TempDirectory directory;
  const std::string text(100'000, 'x');
  const std::string file = directory.put("a.toml", text);
  EXPECT_EQ(read_regular_file(file, text.size()), text);
  EXPECT_EQ(refusal(file, text.size() - 1), file + ": is longer than 99999 bytes");
  EXPECT_EQ(read_regular_file(directory.put("empty", ""), 0), "");
}

/// The kernel's files say that they are empty, and some never end.
TEST(RegularFile, TheSizeItSaysIsNotBelieved) {
  const std::string file = "/proc/self/maps";
  ASSERT_EQ(std::filesystem::file_size(file), 0U);
  EXPECT_EQ(refusal(file, 10), file + ": is longer than 10 bytes");
}

/// Opening a pipe would wait for somebody to write.
TEST(RegularFile, NothingElseIsRead) {
  const test::TempDirectory directory;
  const std::string pipe = directory.path("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& file : {pipe, directory.path().string(), std::string("/dev/zero")}) {
    EXPECT_EQ(refusal(file, 10), file + ": is not a regular file");
  }
  const std::string none = directory.path("none");
  EXPECT_EQ(refusal(none, 10), "cannot read " + none + ": No such file or directory");
}

}  // namespace profile_files_test
}  // namespace lk::emulator
