#pragma once

#include <string>

#include "emulator/ground/language.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace lk::emulator {

/// `--lang en` or `--lang zh`, for the commands whose words exist in both.
void add_language_option(CLI::App& app, std::string& given);

/// What --lang says; without it, what the locale asks for: LC_ALL, LC_MESSAGES, LANG, the first
/// that is set. Throws StartError when `given` is neither.
Language chosen_language(const std::string& given);

/// The language of a locale like zh_CN.UTF-8; English unless it is Chinese.
Language language_of_locale(std::string_view locale);

}  // namespace lk::emulator
