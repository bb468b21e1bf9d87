#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/language.hpp"
#include "emulator/guess/guesser.hpp"

namespace lk::emulator {

/// What was found, for people.
std::string guess_text(const Guesser& guesser, Language language);

/// The values of a trait that are open, by name: "centivolt", "centivolt_and_bus_current".
std::vector<std::string_view> open_values(Trait trait, const Evidence& evidence);
/// The query that would tell, as cansend takes it; empty: there is none.
std::string probe_text(Trait trait, int drive);
/// The unknown traits that tell the generations that fit apart.
std::vector<Trait> telling(const Guess& guess);
/// Lines that start emulators of the drives, those of one kind together.
std::vector<std::string> command_lines(const Guesser& guesser);

}  // namespace lk::emulator
