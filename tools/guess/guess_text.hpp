#pragma once

#include <string>
#include <vector>

#include "emulator/ground/language.hpp"
#include "tools/guess/guesser.hpp"

namespace lk::emulator {

/// What was found, for people.
std::string guess_text(const Guesser& guesser, Language language);

/// A command that emulates a bus, and what is not as sure as it looks.
struct StartCommand {
  std::string line;
  std::vector<std::string> doubts;
};

/// What emulates the drives. A command cannot say several kinds of drive, and a bus can be started
/// once, so a bus with several kinds is in `robot`.
struct Starts {
  std::vector<StartCommand> commands;
  std::string robot;  // a configuration file; empty: no bus needs it
};
Starts starts_of(const Guesser& guesser, Language language);

}  // namespace lk::emulator
