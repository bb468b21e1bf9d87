#pragma once

/// @file Command lines of all commands: parsing, help, problems, and the option --lang.

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/language.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace lk::emulator {

/// Parses the arguments of a command. Returns false if nothing remains to do (`--help`). Words in
/// `first_words` are other commands, valid only as the first argument. Throws StartError.
bool parse_arguments(CLI::App& app, int argc, const char* const* argv,
                     const std::vector<std::string>& first_words = {});

/// Throws StartError with `format` and the first of these options that is given; none if all are
/// absent.
void refuse_options(const CLI::App& app, std::initializer_list<const char*> options,
                    const char* format);

/// Describes --lang in the help.
inline constexpr const char* kLanguageAbout =
    "language of the output: en or zh (default: the locale's)";
/// Adds `--lang en` and `--lang zh`, for commands with output in both languages.
void add_language_option(CLI::App& app, std::string& given);

/// Returns the language of --lang, or of the locale: the first set of LC_ALL, LC_MESSAGES, LANG.
/// Throws StartError if `given` is neither en nor zh.
Language chosen_language(const std::string& given);

/// Returns the language of a locale like zh_CN.UTF-8; English unless it is Chinese.
Language language_of_locale(std::string_view locale);

}  // namespace lk::emulator
