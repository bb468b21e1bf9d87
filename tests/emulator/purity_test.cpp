// The emulator is a function of time and frames. So its pure rooms must not know a clock, a socket,
// a thread, a random device, a log or a stream: this test reads their sources. The link graph is
// read too: protocol links nothing, and protocol and model do not see each other.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <set>
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
  for (const char* room : {"protocol", "model", "emulator/core", "emulator/advice"}) {
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

/// The lines without their comments, so that prose may say "socket".
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

void expect_includes_nothing_of(std::string_view room, const std::set<std::string>& others) {
  for (const auto& file : sources_in(kRoot / room)) {
    for (const auto& line : code_lines(file)) {
      for (const auto& other : others) {
        EXPECT_EQ(line.find("#include \"" + other + "/"), std::string::npos)
            << fs::relative(file, kRoot).string() << " includes " << other;
      }
    }
  }
}

TEST(Purity, ProtocolAndModelDoNotSeeEachOther) {
  expect_includes_nothing_of("protocol", {"model", "emulator", "tests"});
  expect_includes_nothing_of("model", {"protocol", "emulator", "tests"});
}

TEST(Purity, CoreSeesNoOtherRoomOfTheEmulator) {
  for (const auto& file : sources_in(kRoot / "emulator/core")) {
    for (const auto& line : code_lines(file)) {
      EXPECT_TRUE(line.find("#include \"emulator/") == std::string::npos ||
                  line.find("#include \"emulator/core/") != std::string::npos)
          << fs::relative(file, kRoot).string() << ": " << line;
    }
  }
}

TEST(Purity, FoldersOfTheCoreIncludeDownwardsOnly) {
  const std::vector<std::string> order = {"core",   "servo", "wire",    "node",
                                          "faults", "bus",   "scenario"};
  const auto level = [&](const fs::path& file) {
    return std::ranges::find(order, file.parent_path().filename().string()) - order.begin();
  };
  const std::string begin = "#include \"emulator/core/";
  for (const auto& file : sources_in(kRoot / "emulator/core")) {
    EXPECT_LT(level(file), std::ssize(order)) << file;
    for (const auto& line : code_lines(file)) {
      if (!line.starts_with(begin)) continue;
      const fs::path included = "core/" + line.substr(begin.size());
      EXPECT_LE(level(included), level(file)) << fs::relative(file, kRoot).string() << ": " << line;
    }
  }
}

/// The arguments of `target_link_libraries(<target> …)` in a CMakeLists.txt.
std::set<std::string> links_of(const std::string& target, const fs::path& file) {
  const std::string text = text_of(file);
  const std::string call = "target_link_libraries(" + target + " ";
  std::set<std::string> links;
  for (auto at = text.find(call); at != std::string::npos; at = text.find(call, at + 1)) {
    std::istringstream words(text.substr(at + call.size(), text.find(')', at) - at - call.size()));
    for (std::string word; words >> word;) {
      links.insert(word);
    }
  }
  links.erase("PUBLIC");
  links.erase("PRIVATE");
  links.erase("lk_options");  // compiler flags only
  return links;
}

TEST(Purity, LinkGraph) {
  EXPECT_EQ(links_of("lk_protocol", kRoot / "protocol/CMakeLists.txt"), std::set<std::string>{});
  const auto model = links_of("lk_model", kRoot / "model/CMakeLists.txt");
  EXPECT_TRUE(model.empty() || model == std::set<std::string>{"Eigen3::Eigen"});
  EXPECT_EQ(links_of("lk_emulator", kRoot / "emulator/CMakeLists.txt"),
            (std::set<std::string>{"lk_protocol", "lk_model"}));
}

}  // namespace purity_test
