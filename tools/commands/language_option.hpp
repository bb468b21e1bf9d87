#pragma once

#include <string>

#include "emulator/core/language.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace lk::emulator {

/// Adds `--lang en` and `--lang zh`, for commands with output in both languages.
void add_language_option(CLI::App& app, std::string& given);

/// Returns the language of --lang, or of the locale: the first set of LC_ALL, LC_MESSAGES, LANG.
/// Throws StartError if `given` is neither en nor zh.
Language chosen_language(const std::string& given);

/// Returns the language of a locale like zh_CN.UTF-8; English unless it is Chinese.
Language language_of_locale(std::string_view locale);

}  // namespace lk::emulator
