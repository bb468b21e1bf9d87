#include "tools/commands/argument_problem.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

std::string perhaps(const std::string& word, const std::vector<std::string>& known) {
  const std::string meant = closest_match(word, known);
  return meant.empty() ? "" : ", did you mean " + meant + "?";
}

void add_options(const CLI::App& app, std::vector<std::string>& names) {
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
}

std::string option_problem(const CLI::App& app, const std::string& option) {
  std::vector<std::string> known;
  add_options(app, known);
  for (const CLI::App* sub : app.get_subcommands()) add_options(*sub, known);
  const std::string name = option.substr(0, option.find('='));
  return fmt::format("unknown option {}{}", name, perhaps(name, known));
}

}  // namespace

std::string argument_problem(const CLI::App& app, const std::vector<std::string>& first_words) {
  const std::vector<std::string> left_over = app.remaining(true);
  if (left_over.empty()) return "";
  const std::string word = sanitized_line(left_over.front());
  if (word.starts_with('-')) return option_problem(app, word);
  if (std::ranges::find(first_words, word) != first_words.end()) {
    return fmt::format("\"{}\" has to come first: {} {} …", word, app.get_name(), word);
  }
  std::vector<std::string> words = first_words;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App* /*any*/) { return true; })) {
    words.push_back(sub->get_name());
  }
  if (words.empty() || !app.get_subcommands().empty()) {
    return fmt::format("\"{}\" was not expected", word);
  }
  return fmt::format("no command \"{}\"{}", word, perhaps(word, words));
}

}  // namespace lk::emulator
