#pragma once

/// @file Parses the command lines of all commands: help, error messages, and the option --lang.

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/language.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace lk::emulator {

/// Parses the arguments of a command. Returns false if nothing remains to do (`--help`).
/// `first_words` are other commands, which are valid only as first argument. Throws StartError.
bool parse_arguments(CLI::App& app, int argc, const char* const* argv,
                     const std::vector<std::string>& first_words = {});

/// Throws StartError if any of the options is given. The message is `format` with the first one.
void refuse_options(const CLI::App& app, std::initializer_list<const char*> options,
                    const char* format);

/// Text for --lang in the help.
inline constexpr const char* kLanguageAbout =
    "language of the output: en or zh (default: the locale's)";
/// Adds the option --lang, for commands with output in English and Chinese.
void add_language_option(CLI::App& app, std::string& given);

/// Returns the language of --lang, or of the locale: the first set of LC_ALL, LC_MESSAGES, LANG.
/// Throws StartError if `given` is neither en nor zh.
Language chosen_language(const std::string& given);

/// Returns the language of a locale like zh_CN.UTF-8; English unless it is Chinese.
Language language_of_locale(std::string_view locale);

}  // namespace lk::emulator
