#pragma once

#include <string>
#include <vector>

namespace lk::emulator {

/// Candidates for the last of `words`, the command line without the program's name. Bash splits
/// words at '=', the other shells do not; both forms are understood. Empty: nothing is known, so
/// that the shell offers files.
std::vector<std::string> completions(std::vector<std::string> words);

/// `lk-emu __complete WORDS...` prints them, one a line. packaging/completions/ calls it.
int run_complete(int argc, const char* const* argv);

}  // namespace lk::emulator
