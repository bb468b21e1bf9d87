#pragma once

/// @file What `lk-emu WORD …` does besides running drives: each word has a function, and a file, of
/// its own.

#include <span>

namespace lk::emulator {

struct Command {
  const char* word;
  const char* about;  // for --help
  /// `argv[0]` is the word. Returns the exit status; throws StartError.
  int (*run)(int argc, const char* const* argv);
};

/// In the order of listings.
std::span<const Command> commands();

// ctl_command.cpp
int run_ctl(int argc, const char* const* argv);
// faults_command.cpp
int run_faults(int argc, const char* const* argv);
// replay_command.cpp
int run_replay(int argc, const char* const* argv);
// run_command.cpp
int run_scenarios(int argc, const char* const* argv);

}  // namespace lk::emulator
