#include "tools/commands/arguments.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <map>
#include <memory>
#include <sstream>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

// --- help

constexpr std::size_t kColumns = 80;

/// Breaks lines between words, at `width` columns.
std::string wrapped(const std::string& text, std::size_t width) {
  std::istringstream words(text);
  std::string all;
  std::size_t line = 0;
  for (std::string word; words >> word; line += word.size()) {
    const bool is_full = line + 1 + word.size() > width;
    if (!all.empty()) {
      all += is_full ? '\n' : ' ';
      line = is_full ? 0 : line + 1;
    }
    all += word;
  }
  return all;
}

/// Wraps each paragraph; indented lines stay as they are.
std::string wrapped_paragraphs(const std::string& text) {
  std::istringstream lines(text);
  std::string all;
  std::string paragraph;
  const auto end_paragraph = [&] {
    if (!paragraph.empty()) all += wrapped(paragraph, kColumns) + '\n';
    paragraph.clear();
  };
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line.front() == ' ') {
      end_paragraph();
      all += line + '\n';
    } else {
      paragraph += line + ' ';
    }
  }
  end_paragraph();
  return all;
}

class WrappedFormatter : public CLI::Formatter {
 public:
  std::string make_option_desc(const CLI::Option* option) const override {
    return beside_names(CLI::Formatter::make_option_desc(option));
  }
  std::string make_subcommand(const CLI::App* word) const override {
    std::stringstream out;
    CLI::detail::format_help(out, word->get_display_name(true),
                             beside_names(word->get_description()), get_column_width());
    return out.str();
  }
  std::string make_description(const CLI::App* app) const override {
    return wrapped_paragraphs(CLI::Formatter::make_description(app));
  }
  std::string make_footer(const CLI::App* app) const override {
    return wrapped_paragraphs(CLI::Formatter::make_footer(app));
  }

 private:
  std::string beside_names(const std::string& text) const {
    return wrapped(text, kColumns - std::min(get_column_width(), kColumns / 2));
  }
};

void wrap_help(CLI::App& app) {
  const auto formatter = std::make_shared<WrappedFormatter>();
  app.formatter(formatter);
  for (CLI::App* const word : app.get_subcommands({})) word->formatter(formatter);
}

// --- error messages

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

/// Describes the first argument that `app` could not parse, with a suggestion; empty if all are
/// parsed.
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

/// Options that name a file. No two of them may name the same file.
constexpr const char* kFiles[] = {"--output", "--report", "--csv",   "--candump",
                                  "--html",   "--json",   "--junit", "--scenario"};

/// Throws if two options name the same file: the output that is written last would overwrite it.
void check_files(const CLI::App& app) {
  std::map<std::string, std::string> taken;  // file, option
  for (const char* name : kFiles) {
    const CLI::Option* const option = app.get_option_no_throw(name);
    if (option == nullptr || option->empty() || option->get_items_expected_max() == 0) continue;
    const std::string file = option->as<std::string>();
    if (file == "-" || file.starts_with("/dev/")) continue;
    const auto [other, free] = taken.emplace(file, name);
    if (!free) {
      throw StartError(std::string(name) + ": " + sanitized_line(file) + " is the file of " +
                       other->second + " already");
    }
  }
}

}  // namespace

bool parse_arguments(CLI::App& app, int argc, const char* const* argv,
                     const std::vector<std::string>& first_words) {
  wrap_help(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& answer) {
    app.exit(answer);
    return false;
  } catch (const CLI::ParseError& problem) {
    // If an argument is unexpected, CLI11's message is vague, or is about another argument.
    const std::string left_over = argument_problem(app, first_words);
    throw StartError((left_over.empty() ? problem.what() : left_over) + " (see " + app.get_name() +
                     " --help)");
  }
  check_files(app);
  for (const CLI::App* const word : app.get_subcommands()) check_files(*word);
  return true;
}

void refuse_options(const CLI::App& app, std::initializer_list<const char*> options,
                    const char* format) {
  for (const char* const option : options) {
    if (app.count(option) > 0) throw StartError(fmt::format(fmt::runtime(format), option));
  }
}

// --- language

void add_language_option(CLI::App& app, std::string& given) {
  app.add_option("--lang", given, kLanguageAbout)->type_name("LANG");
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
