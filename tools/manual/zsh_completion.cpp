#include <fmt/format.h>

#include <algorithm>

#include "tools/manual/completions.hpp"
#include "tools/manual/values.hpp"

namespace lk::manual {
namespace {

constexpr const char* kZshHead = R"(#compdef lk-emu lk-emu-body
# zsh completion for lk-emu, made from what its --help is made from.

_lk-emu-interfaces() {
  local -a names
  local file
  for file in /sys/class/net/*/type(N); do
    [[ $(<$file) == 280 ]] && names+=(${file:h:t})
  done
  compadd -a names
}
)";

/// Of a description within a specification.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

/// What _arguments does to complete a value.
std::string action(const std::string& value) {
  const Choices choices = choices_of(value);
  const std::string words = spaced(choices.words);
  if (choices.list) return " _sequence compadd - " + words;
  if (choices.interfaces) return "_lk-emu-interfaces";
  std::string files = choices.directories ? "_files -/" : "_files";
  if (choices.files || choices.directories) {
    if (words.empty()) return files;
    return fmt::format(" _alternative \"files:file:{}\" \"words:word:({})\"", files, words);
  }
  return words.empty() ? " " : "(" + words + ")";
}

std::string value_spec(const Argument& argument) {
  return fmt::format(":{}:{}", escaped(argument.value), action(argument.value));
}

std::string option_specs(const Argument& option) {
  std::string text;
  for (const std::string& name : option.names) {
    const bool is_long = name.starts_with("--");
    std::string spec = option.many ? "*" : fmt::format("({})", spaced(option.names));
    spec += name + (option.value.empty() ? "" : is_long ? "=" : "+");
    spec += fmt::format("[{}]", escaped(option.about));
    if (!option.value.empty()) spec += value_spec(option);
    text += fmt::format(" \\\n    {}", shell_quoted(spec));
  }
  return text;
}

std::string function_name(const Word& word) {
  std::string name = word.path;
  std::ranges::replace(name, ' ', '_');
  return fmt::format("_{}", name);
}

/// The program's own is called last: by then all others are known.
void add_function(std::string& text, const Word& word, const Word* parent) {
  for (const Word& below : word.words) add_function(text, below, &word);
  std::string specs;
  for (const Argument& option : all_options(word, parent)) specs += option_specs(option);
  for (const Argument& positional : word.positionals) {
    specs += fmt::format(" \\\n    '{}{}'", positional.many ? "*" : "", value_spec(positional));
  }
  if (word.words.empty()) {
    text += fmt::format("\n{}() {{\n  _arguments -s{}\n}}\n", function_name(word), specs);
    return;
  }
  std::string names;
  std::string calls;
  for (const Word& below : word.words) {
    names += fmt::format(R"( {}\:"{}")", own_name(below), escaped(below.about));
    calls += fmt::format("    {}) {} ;;\n", own_name(below), function_name(below));
  }
  text += fmt::format(
      "\n{}() {{\n  local curcontext=$curcontext state line\n  typeset -A opt_args\n"
      "  _arguments -C -s -A '-*'{} \\\n    {} \\\n    '*:: :->rest'\n  [[ $state == rest ]] || "
      "return\n"
      "  case $line[1] in\n{}  esac\n}}\n",
      function_name(word), specs, shell_quoted(fmt::format(": :(({}))", names.substr(1))), calls);
}

}  // namespace

std::string zsh_completion(const Word& program) {
  std::string text = kZshHead;
  add_function(text, program, nullptr);
  return text + "\n_lk-emu \"$@\"\n";
}

}  // namespace lk::manual
