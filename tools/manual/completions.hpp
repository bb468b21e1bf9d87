#pragma once

#include <string>

#include "tools/manual/word.hpp"

namespace lk::manual {

std::string bash_completion(const Word& program);
std::string fish_completion(const Word& program);
std::string zsh_completion(const Word& program);

/// Of `word` and those whose options it takes too.
std::vector<Argument> all_options(const Word& word, const Word* parent);

/// "a b c"
std::string spaced(const std::vector<std::string>& words);

/// Between single quotes, as all three shells understand them.
std::string shell_quoted(const std::string& text);

}  // namespace lk::manual
