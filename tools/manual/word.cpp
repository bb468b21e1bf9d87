#include "tools/manual/word.hpp"

#include <CLI/CLI.hpp>

#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"

namespace lk::manual {
namespace {

std::vector<std::string> paragraphs(const std::string& text) {
  std::vector<std::string> found(1);
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line = text.substr(begin, end - begin);
    begin = end + 1;
    if (!line.empty()) {
      found.back() += line + '\n';
    } else if (!found.back().empty()) {
      found.emplace_back();
    }
  }
  if (found.back().empty()) found.pop_back();
  return found;
}

Argument read_argument(const CLI::Option& option) {
  Argument argument;
  for (const std::string& name : option.get_snames()) argument.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) argument.names.push_back("--" + name);
  if (option.get_items_expected_max() > 0) argument.value = option.get_type_name();
  // CLI11 calls everything text that nobody has called otherwise.
  if (option.get_positional() && argument.value == "TEXT") {
    argument.value = option.get_name(true);
  }
  argument.about = option.get_description();
  argument.many = option.get_items_expected_max() > 1;
  argument.required = option.get_required();
  return argument;
}

Word read_word(const CLI::App& app, const std::string& path) {
  Word word;
  word.path = path;
  word.about = app.get_description();
  word.takes_options_of_parent = app.get_parent() != nullptr && app.get_fallthrough();
  for (const CLI::Option* option : app.get_options()) {
    (option->get_positional() ? word.positionals : word.options).push_back(read_argument(*option));
  }
  // A word below inherits the footer, which is not its own.
  if (app.get_parent() == nullptr) word.notes = paragraphs(app.get_footer());
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App* /*any*/) { return true; })) {
    word.words.push_back(read_word(*sub, path + " " + sub->get_name()));
  }
  return word;
}

}  // namespace

std::string own_name(const Word& word) { return word.path.substr(word.path.rfind(' ') + 1); }

Word read_program() {
  Word program = read_word(*emulator::program_app(), "lk-emu");
  for (const emulator::Command& command : emulator::commands()) {
    program.words.push_back(read_word(*command.app(), std::string("lk-emu ") + command.word));
  }
  return program;
}

}  // namespace lk::manual
