#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "emulator/core/start_error.hpp"
#include "emulator/files/profile_files.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/processes.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDemoFooter = R"(
Needs no bus and no privileges: robot and host talk over a TCP port of this machine, the dashboard
is at http://127.0.0.1:8474/ or, where that is taken, at the address that is printed. The host is a
program in Python: python3-can has to be installed. Needs lk-emu-body.

Exit status: 0 ended by Ctrl-C or SIGTERM, 1 robot or host had failed, 2 it could not begin.)";

/// A shipped robot, and a host program for it: a file in python/examples with its arguments.
struct Demo {
  const char* word;
  const char* robot;
  std::vector<std::string> host;
};

std::vector<Demo> demos() {
  return {{"quadruped", "quadruped_on_the_ground", {"quadruped_walk.py", "--forever"}},
          {"arm", "six_joint_arm", {"arm_square.py", "six", "--forever"}}};
}

Demo find_demo(const std::string& word) {
  std::string known;
  for (const Demo& demo : demos()) {
    if (word == demo.word) return demo;
    known += (known.empty() ? "" : ", ") + std::string(demo.word);
  }
  throw StartError(fmt::format("demo: unknown robot \"{}\", known are {}", word, known));
}

fs::path demo_script() {
  const fs::path script = python_directory() / "examples/demo.py";
  std::error_code none_there;
  if (fs::exists(script, none_there)) return script;
  throw StartError("demo: python/examples/demo.py not found in " + config_directory().string());
}

/// Returns the program that can simulate bodies: this one, or lk-emu-body in the same directory.
fs::path program_with_bodies() {
  const fs::path self = fs::read_symlink("/proc/self/exe");
  if (body_loader()) return self;
  const fs::path other = self.parent_path() / "lk-emu-body";
  if (::access(other.c_str(), X_OK) == 0) return other;
  throw StartError("demo: its robots have a body: this needs the package lk-emu-body");
}

[[noreturn]] void show_demo(const std::string& word, bool no_browser) {
  const Demo demo = find_demo(word);
  std::vector<std::string> words{"python3", "-B", demo_script().string()};
  if (no_browser) words.emplace_back("--no-browser");
  words.insert(words.end(),
               {program_with_bodies().string(), shipped_file(kRobots, demo.robot).string()});
  words.insert(words.end(), demo.host.begin(), demo.host.end());
  const int error = become(std::move(words));
  if (error == ENOENT) {
    throw StartError("demo: its host needs python3 and python-can: apt install python3-can");
  }
  throw StartError(std::string("demo: python3: ") + std::strerror(error));
}

}  // namespace

RunCommand declare_demo(CLI::App& app, Arguments /*arguments*/) {
  struct Given {
    std::string word;
    bool no_browser = false;
  };
  const auto given = std::make_shared<Given>();
  app.footer(kDemoFooter);
  std::string words;
  for (const Demo& demo : demos()) words += (words.empty() ? "" : "|") + std::string(demo.word);
  app.add_option("ROBOT", given->word,
                 "which: a dog that walks to and fro, an arm that draws squares")
      ->type_name(words)
      ->required();
  app.add_flag("--no-browser", given->no_browser,
               "print the dashboard's address without opening a browser");
  return [given]() -> int { show_demo(given->word, given->no_browser); };
}

}  // namespace lk::emulator
