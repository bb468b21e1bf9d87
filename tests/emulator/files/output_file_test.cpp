#include "emulator/files/output_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <set>
#include <string>

#include "emulator/core/start_error.hpp"
#include "emulator/files/durable_file.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::emulator {
namespace output_file_test {

namespace fs = std::filesystem;

using Names = std::set<std::string>;

void write(const std::string& path, const std::string& text) {
  OutputFile file(path, "--csv");
  file.write(text);
  file.commit();
}

TEST(OutputFile, AppearsOnlyWhenComplete) {
  const test::TempDirectory directory;
  directory.put("a.csv", "old");
  {
    OutputFile file(directory.path("a.csv"), "--csv");
    file.write("half");
  }
  EXPECT_EQ(directory.text_of("a.csv"), "old");
  write(directory.path("a.csv"), "new");
  EXPECT_EQ(directory.text_of("a.csv"), "new");
  EXPECT_EQ(directory.names(), Names{"a.csv"});
}

TEST(OutputFile, ReplacesTheTargetOfALink) {
  const test::TempDirectory directory;
  fs::create_directory(directory.path() / "runs");
  directory.put("runs/1.csv", "old");
  fs::create_symlink("runs/last.csv", directory.path() / "a.csv");
  fs::create_symlink("1.csv", directory.path() / "runs/last.csv");
  {
    OutputFile file(directory.path("a.csv"), "--csv");
    file.write("new");
    EXPECT_EQ(directory.text_of("runs/1.csv"), "old");
    file.commit();
  }
  EXPECT_EQ(directory.text_of("runs/1.csv"), "new");
  EXPECT_TRUE(fs::is_symlink(directory.path() / "a.csv"));
  EXPECT_TRUE(fs::is_symlink(directory.path() / "runs/last.csv"));
  EXPECT_EQ(directory.names(), (Names{"a.csv", "runs"}));
}

TEST(OutputFile, CreatesTheTargetOfADanglingLink) {
  const test::TempDirectory directory;
  fs::create_symlink("b.csv", directory.path() / "a.csv");
  write(directory.path("a.csv"), "new");
  EXPECT_TRUE(fs::is_symlink(directory.path() / "a.csv"));
  EXPECT_EQ(directory.text_of("b.csv"), "new");
}

TEST(OutputFile, DoesNotFollowALinkAtTheTemporaryName) {
  const test::TempDirectory directory;
  const std::string other = directory.put("other", "precious");
  fs::create_symlink(other, directory.path("a.csv.part-" + std::to_string(::getpid())));
  write(directory.path("a.csv"), "new");
  EXPECT_EQ(directory.text_of("other"), "precious");
  EXPECT_EQ(directory.text_of("a.csv"), "new");
  EXPECT_EQ(directory.names(), (Names{"a.csv", "other"}));
}

TEST(OutputFile, RejectsCircularLinks) {
  const test::TempDirectory directory;
  fs::create_symlink("a.csv", directory.path() / "a.csv");
  const std::string path = directory.path("a.csv");
  try {
    const OutputFile file(path, "--csv");
    FAIL() << "was taken";
  } catch (const StartError& problem) {
    EXPECT_EQ(problem.what(),
              "--csv: cannot write " + path + ": Too many levels of symbolic links");
  }
}

/// /dev/stdout links to /proc/self/fd/1, and `> FILE` opens a regular file there.
TEST(OutputFile, WritesToDescriptorLinksInPlace) {
  const test::TempDirectory directory;
  directory.put("shell", "");
  const Descriptor open(::open(directory.path("shell").c_str(), O_WRONLY));
  const std::string in_proc = "/proc/self/fd/" + std::to_string(open.get());
  fs::create_symlink(in_proc, directory.path() / "stdout");
  EXPECT_EQ(write_all(open.get(), "before\n"), 0);
  write(directory.path("stdout"), "rows\n");
  write(in_proc, "more\n");
  EXPECT_EQ(write_all(open.get(), "after\n"), 0);
  EXPECT_EQ(directory.text_of("shell"), "before\nrows\nmore\nafter\n");
  EXPECT_EQ(directory.names(), (Names{"shell", "stdout"}));
  EXPECT_TRUE(fs::is_symlink(directory.path() / "stdout"));
}

}  // namespace output_file_test
}  // namespace lk::emulator
