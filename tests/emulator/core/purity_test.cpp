// The emulator is a function of time and frames. Its pure rooms must not use clocks, sockets,
// threads, random devices, logs or streams: this test reads their sources. tests/rooms_test.py
// checks their includes.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace purity_test {

namespace fs = std::filesystem;

const fs::path kRoot = LKEMU_SOURCE_DIR;

std::vector<fs::path> sources_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() == ".hpp" || entry.path().extension() == ".cpp") {
      files.push_back(entry.path());
    }
  }
  return files;
}

std::vector<fs::path> pure_sources() {
  std::vector<fs::path> files;
  for (const char* room : {"protocol", "model", "emulator/core", "emulator/monitor/advice"}) {
    const auto more = sources_in(kRoot / room);
    files.insert(files.end(), more.begin(), more.end());
  }
  return files;
}

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// Returns the lines without comments, which may contain words such as "socket".
std::vector<std::string> code_lines(const fs::path& file) {
  std::istringstream text(text_of(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) {
    lines.push_back(line.substr(0, line.find("//")));
  }
  return lines;
}

TEST(Purity, NoClockSocketThreadRandomLogOrStream) {
  constexpr std::array<std::string_view, 29> kForbidden{
      "system_clock",  "steady_clock",  "high_resolution_clock",
      "clock_gettime", "gettimeofday",  "<ctime>",
      "<time.h>",      "time(nullptr)", "sys/socket",
      "linux/can",     "<unistd.h>",    "<boost/",
      "<thread>",      "<mutex>",       "<atomic>",
      "<future>",      "std::async",    "rand(",
      "<random>",      "random_device", "spdlog",
      "<iostream>",    "<fstream>",     "std::cout",
      "std::cerr",     "printf(",       "unordered_map",
      "unordered_set", "getenv"};
  const auto files = pure_sources();
  EXPECT_GT(files.size(), 25U);
  for (const auto& file : files) {
    int number = 0;
    for (const auto& line : code_lines(file)) {
      ++number;
      for (const auto word : kForbidden) {
        EXPECT_EQ(line.find(word), std::string::npos)
            << fs::relative(file, kRoot).string() << ':' << number << ": " << word;
      }
    }
  }
}

TEST(Purity, FoldersOfTheCoreIncludeDownwardsOnly) {
  const std::vector<std::string> order = {"core",   "servo", "wire",     "node",
                                          "faults", "bus",   "coupling", "scenario"};
  const auto level = [&](const fs::path& file) {
    return std::ranges::find(order, file.parent_path().filename().string()) - order.begin();
  };
  const std::string begin = "#include \"emulator/core/";
  const auto files = sources_in(kRoot / "emulator/core");
  ASSERT_FALSE(files.empty());
  for (const auto& file : files) {
    EXPECT_LT(level(file), std::ssize(order)) << file;
    for (const auto& line : code_lines(file)) {
      if (!line.starts_with(begin)) continue;
      const fs::path included = "core/" + line.substr(begin.size());
      EXPECT_LE(level(included), level(file)) << fs::relative(file, kRoot).string() << ": " << line;
    }
  }
}

}  // namespace purity_test
