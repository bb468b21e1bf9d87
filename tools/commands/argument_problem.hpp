#pragma once

#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace lk::emulator {

/// What `app` could not place of the arguments that it has parsed, the first of it, with what may
/// have been meant; empty when it has placed all. `first_words` are those that only count as the
/// first argument.
std::string argument_problem(const CLI::App& app, const std::vector<std::string>& first_words);

}  // namespace lk::emulator
