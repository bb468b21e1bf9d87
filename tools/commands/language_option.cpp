#include "tools/commands/language_option.hpp"

#include <CLI/CLI.hpp>
#include <cstdlib>

#include "emulator/core/start_error.hpp"
#include "tools/commands/cli.hpp"

namespace lk::emulator {

void add_language_option(CLI::App& app, std::string& given) {
  app.add_option("--lang", given, "language of the output: en or zh (default: the locale's)")
      ->type_name("LANG");
}

Language chosen_language(const std::string& given) {
  if (given == "en") return Language::kEnglish;
  if (given == "zh") return Language::kChinese;
  if (!given.empty()) throw StartError("--lang: \"" + given + "\" is neither en nor zh");
  for (const char* name : {"LC_ALL", "LC_MESSAGES", "LANG"}) {
    const char* const locale = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): before threads
    if (locale != nullptr && *locale != '\0') return language_of_locale(locale);
  }
  return Language::kEnglish;
}

Language language_of_locale(std::string_view locale) {
  const std::string_view language = locale.substr(0, locale.find_first_of("_.@"));
  return language == "zh" ? Language::kChinese : Language::kEnglish;
}

}  // namespace lk::emulator
