#pragma once

#include <string>
#include <vector>

namespace lk::emulator {

/// Returns candidates for the last of `words`, the command line without the program's name. Accepts
/// words that are split at '=' (Bash) or not (other shells). Empty: unknown, so that the shell
/// offers files.
std::vector<std::string> completions(std::vector<std::string> words);

/// Runs `lk-emu __complete WORDS...` of packaging/completions/: prints them, one per line.
int run_complete(int argc, const char* const* argv);

}  // namespace lk::emulator
