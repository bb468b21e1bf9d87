#pragma once

/// @file The commands `lk-emu WORD …`. Each command is defined in its own file.

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace lk::emulator {

/// Runs a command after its arguments are parsed. Returns the exit status; throws StartError.
using RunCommand = std::function<int()>;

/// Arguments of a command. Element 0 is the command's word.
using Arguments = std::span<const char* const>;

struct Command {
  const char* word;
  const char* about;  // for --help
  /// Adds the options of the command to `app`. Returns the function that runs the command.
  RunCommand (*declare)(CLI::App& app, Arguments arguments);
};

/// Returns all commands, in the order in which the help lists them.
std::span<const Command> commands();
/// Returns the command of this word; null if there is none.
const Command* find_command(std::string_view word);

/// A command with its options. `app` stores values in `run`, so keep both.
struct DeclaredCommand {
  std::shared_ptr<CLI::App> app;
  RunCommand run;
};
DeclaredCommand declare(const Command& command, Arguments arguments = {});

/// Parses the arguments and runs the command. Returns the exit status; throws StartError.
int run_command(const Command& command, Arguments arguments);

/// Prints the possible completions of the last word of a command line, for shells.
int run_complete(Arguments words);

// Defined in python_commands.cpp:
RunCommand declare_campaign(CLI::App& app, Arguments arguments);
RunCommand declare_identify(CLI::App& app, Arguments arguments);
RunCommand declare_plot(CLI::App& app, Arguments arguments);
// Each defined in the file of its name, e.g. ctl_command.cpp:
RunCommand declare_ctl(CLI::App& app, Arguments arguments);
RunCommand declare_decode(CLI::App& app, Arguments arguments);
RunCommand declare_demo(CLI::App& app, Arguments arguments);
RunCommand declare_faults(CLI::App& app, Arguments arguments);
RunCommand declare_motors(CLI::App& app, Arguments arguments);
RunCommand declare_replay(CLI::App& app, Arguments arguments);
RunCommand declare_run(CLI::App& app, Arguments arguments);

}  // namespace lk::emulator
