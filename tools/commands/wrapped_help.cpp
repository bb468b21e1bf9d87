#include "tools/commands/wrapped_help.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <memory>
#include <sstream>
#include <string>

namespace lk::emulator {
namespace {

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

}  // namespace

void wrap_help(CLI::App& app) {
  const auto formatter = std::make_shared<WrappedFormatter>();
  app.formatter(formatter);
  for (CLI::App* const word : app.get_subcommands({})) word->formatter(formatter);
}

}  // namespace lk::emulator
