#pragma once

/// @file The commands `lk-emu WORD …`; each has its own function and file.

#include <memory>
#include <span>

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace lk::emulator {

struct Command {
  const char* word;
  const char* about;  // for --help
  /// `argv[0]` is the word. Returns the exit status; throws StartError.
  int (*run)(int argc, const char* const* argv);
  /// Returns its options, for completions.
  std::shared_ptr<CLI::App> (*app)();
};

/// Returns all commands, in the order of listings.
std::span<const Command> commands();

// campaign_command.cpp
int run_campaigns(int argc, const char* const* argv);
std::shared_ptr<CLI::App> campaign_app();
// ctl_command.cpp
int run_ctl(int argc, const char* const* argv);
std::shared_ptr<CLI::App> ctl_app();
// decode_command.cpp
int run_decode(int argc, const char* const* argv);
std::shared_ptr<CLI::App> decode_app();
// demo_command.cpp
int run_demo(int argc, const char* const* argv);
std::shared_ptr<CLI::App> demo_app();
// faults_command.cpp
int run_faults(int argc, const char* const* argv);
std::shared_ptr<CLI::App> faults_app();
// identify_command.cpp
int run_identify(int argc, const char* const* argv);
std::shared_ptr<CLI::App> identify_app();
// motors_command.cpp
int run_motors(int argc, const char* const* argv);
std::shared_ptr<CLI::App> motors_app();
// plot_command.cpp
int run_plot(int argc, const char* const* argv);
std::shared_ptr<CLI::App> plot_app();
// replay_command.cpp
int run_replay(int argc, const char* const* argv);
std::shared_ptr<CLI::App> replay_app();
// run_command.cpp
int run_scenarios(int argc, const char* const* argv);
std::shared_ptr<CLI::App> scenarios_app();

}  // namespace lk::emulator
