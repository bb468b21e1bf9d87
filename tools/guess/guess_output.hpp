#pragma once

#include <string>
#include <vector>

#include "emulator/core/language.hpp"
#include "tools/guess/guesser.hpp"

namespace lk::emulator {

/// Returns the findings as text.
std::string guess_text(const Guesser& guesser, Language language);
/// Returns the findings as JSON lines: one object per drive, then a summary
/// (docs/reference/formats.md).
std::string guess_json(const Guesser& guesser);

/// A command that emulates a bus, and its assumptions.
struct StartCommand {
  std::string line;
  std::vector<std::string> doubts;
};

/// Commands that emulate the drives. A command allows one kind of drive on a bus, so a bus with
/// several kinds is in `robot`.
struct Starts {
  std::vector<StartCommand> commands;
  std::string robot;  // a configuration file; empty: no bus needs it
};
Starts starts_of(const Guesser& guesser, Language language);

}  // namespace lk::emulator
