#include "tools/commands/commands.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>

#include "tools/commands/arguments.hpp"

namespace lk::emulator {
namespace {

constexpr Command kCommands[] = {
    {"campaign", "run many cases of a scenario with faults, and report the results",
     declare_campaign},
    {"ctl", "inspect and control a running lk-emu", declare_ctl},
    {"decode", "explain the frames of a bus, from candump's output", declare_decode},
    {"demo", "show a robot that walks or draws, in the browser", declare_demo},
    {"faults", "list the faults that can be injected, or show one of them", declare_faults},
    {"identify", "estimate a motor's parameters from its logs, and write a motor file",
     declare_identify},
    {"motors", "list the motor profiles, or show one of them", declare_motors},
    {"plot", "draw a CSV file of a run as SVG or PNG", declare_plot},
    {"replay", "run a recording again and compare, or compare a real robot's log", declare_replay},
    {"run", "run scenarios in simulated time, without a CAN bus", declare_run},
};

}  // namespace

std::span<const Command> commands() { return kCommands; }

const Command* find_command(std::string_view word) {
  const auto* const found = std::ranges::find(kCommands, word, &Command::word);
  return found != std::end(kCommands) ? found : nullptr;
}

DeclaredCommand declare(const Command& command, Arguments arguments) {
  std::string about = command.about;
  about.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(about.front())));
  const auto app = std::make_shared<CLI::App>(about, std::string("lk-emu ") + command.word);
  return {app, command.declare(*app, arguments)};
}

int run_command(const Command& command, Arguments arguments) {
  const DeclaredCommand declared = declare(command, arguments);
  const bool is_parsed =
      parse_arguments(*declared.app, static_cast<int>(arguments.size()), arguments.data());
  return is_parsed ? declared.run() : 0;
}

}  // namespace lk::emulator
