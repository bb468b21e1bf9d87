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

/// A command line that emulates a bus, and what it assumes without proof.
struct StartCommand {
  std::string line;
  std::vector<std::string> doubts;
};

/// Command lines that emulate the drives. A command line allows only one kind of drive on a bus.
/// Buses with several kinds are in `robot`.
struct Starts {
  std::vector<StartCommand> commands;
  std::string robot;  // text of a configuration file; empty: no bus needs one
};
Starts starts_of(const Guesser& guesser, Language language);

}  // namespace lk::emulator
