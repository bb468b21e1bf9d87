#pragma once

#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace lk::emulator {

/// Describes the first argument that `app` could not parse, with a suggestion; empty if all are
/// parsed. Words in `first_words` are valid only as the first argument.
std::string argument_problem(const CLI::App& app, const std::vector<std::string>& first_words);

}  // namespace lk::emulator
