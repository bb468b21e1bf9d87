#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <string_view>
#include <utility>

#include "emulator/config/config_quirks.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/files/profile_files.hpp"
#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"

namespace lk::emulator {
namespace {

using Names = std::vector<std::string>;

Names fault_words() {
  Names words;
  for (const FaultRow& row : fault_table()) words.emplace_back(row.word);
  return words;
}

Names signal_words() {
  Names words;
  for (const Signal& signal : signals()) words.emplace_back(signal.name);
  return words;
}

Names can_interfaces() {
  Names names;
  std::error_code unreadable;
  for (const auto& entry : std::filesystem::directory_iterator("/sys/class/net", unreadable)) {
    int type = 0;
    std::ifstream(entry.path() / "type") >> type;
    if (type == 280) names.push_back(entry.path().filename());  // ARPHRD_CAN
  }
  std::ranges::sort(names);
  return names;
}

/// Returns the values for an option's type in --help: "MOTOR", "on|off|cycle", "SCENARIO|stop".
Names values(std::string_view type) {
  if (const auto bar = type.find('|'); bar != std::string_view::npos) {
    Names words = values(type.substr(0, bar));
    for (std::string& word : values(type.substr(bar + 1))) words.push_back(std::move(word));
    return words;
  }
  if (type == "MOTOR") return motor_words();
  if (type == "ROBOT") return known_files(kRobots);
  if (type == "SCENARIO") return known_files(kScenarios);
  if (type == "PLAN") return known_files(kCampaigns);
  if (type == "FAULT") return fault_words();
  if (type == "SIGNALS") return signal_words();
  if (type == "BUS") return can_interfaces();
  if (type == "MODE") return {"realtime", "stepped", "x0.1", "x10"};
  if (type == "LANG") return {"en", "zh"};
  if (type == "LEVEL") return {std::begin(kLogLevels), std::end(kLogLevels)};
  // A type in small letters is a literal value, a type in capitals a placeholder.
  if (std::ranges::all_of(type, [](char c) { return c >= 'a' && c <= 'z'; })) {
    return {std::string(type)};
  }
  return {};
}

Names values(const CLI::Option& option) {
  if (option.check_lname("generation")) return generation_words();
  const std::string type = option.get_type_name();
  // CLI11's default type is TEXT. A positional argument then has its name as type.
  return values(option.get_positional() && type == "TEXT" ? option.get_name(true) : type);
}

auto subcommands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* /*any*/) { return true; });
}

const CLI::App* find_subcommand(const CLI::App& app, const std::string& word) {
  const auto all = subcommands(app);
  const auto found = std::ranges::find(all, word, [](auto* sub) { return sub->get_name(); });
  return found != all.end() ? *found : nullptr;
}

/// State of the command line before the word to complete.
class Place {
 public:
  Place() : root_(program_app()), app_(root_.get()) {}

  void pass(const std::string& word) {
    const bool first = std::exchange(first_, false);
    if (awaiting_ != nullptr) {
      if (word != "=") awaiting_ = nullptr;
    } else if (word.starts_with('-')) {
      const CLI::Option* const option = find_option(word);
      if (option != nullptr && option->get_items_expected_max() > 0) awaiting_ = option;
    } else if (const Command* const command = first ? find_command(word) : nullptr) {
      root_ = declare(*command).app;
      app_ = root_.get();
    } else if (const CLI::App* const sub = find_subcommand(*app_, word)) {
      app_ = sub;
    } else {
      ++position_;
    }
  }

  Names candidates(const std::string& word) const {
    if (awaiting_ != nullptr) return values(*awaiting_);
    if (word.starts_with('-')) return option_names();
    Names words;
    if (position_ == 0) {
      for (const CLI::App* sub : subcommands(*app_)) words.push_back(sub->get_name());
    }
    if (first_) {
      for (const Command& command : commands()) words.emplace_back(command.word);
    }
    if (const CLI::Option* const positional = find_positional()) {
      for (std::string& value : values(*positional)) words.push_back(std::move(value));
    }
    return words;
  }

 private:
  const CLI::Option* find_option(const std::string& name) const {
    const CLI::Option* const own = app_->get_option_no_throw(name);
    if (own != nullptr || !has_options_of_parent()) return own;
    return app_->get_parent()->get_option_no_throw(name);
  }

  bool has_options_of_parent() const {
    return app_->get_parent() != nullptr && app_->get_fallthrough();
  }

  Names option_names() const {
    std::set<std::string> names;
    for (const CLI::App* app : {app_, has_options_of_parent() ? app_->get_parent() : app_}) {
      for (const CLI::Option* option : app->get_options()) {
        for (const std::string& name : option->get_snames()) names.insert("-" + name);
        for (const std::string& name : option->get_lnames()) names.insert("--" + name);
      }
    }
    return {names.begin(), names.end()};
  }

  /// Returns the positional argument for the next word. The last one may take several words.
  const CLI::Option* find_positional() const {
    std::size_t left = position_;
    for (const CLI::Option* option : app_->get_options()) {
      if (!option->get_positional()) continue;
      if (left == 0 || option->get_items_expected_max() > 1) return option;
      --left;
    }
    return nullptr;
  }

  std::shared_ptr<CLI::App> root_;
  const CLI::App* app_;
  const CLI::Option* awaiting_ = nullptr;  // option whose value is the next word; null: none
  std::size_t position_ = 0;               // positional arguments so far
  bool first_ = true;
};

Names completions(Names words) {
  std::string word = words.empty() ? "" : words.back();
  if (!words.empty()) words.pop_back();
  Place place;
  for (const std::string& passed : words) place.pass(passed);
  std::string kept;  // start of the word, which is not completed: "--option=", "a,b,"
  if (word == "=") word.clear();
  if (const auto equals = word.find('='); word.starts_with("--") && equals != std::string::npos) {
    place.pass(word.substr(0, equals));
    kept = word.substr(0, equals + 1);
    word.erase(0, equals + 1);
  }
  const std::size_t list = word.rfind(',') + 1;  // after the last comma; 0 without a comma
  kept += word.substr(0, list);
  word.erase(0, list);
  Names found = place.candidates(word);
  std::erase_if(found, [&word](const std::string& one) { return !one.starts_with(word); });
  for (std::string& one : found) one.insert(0, kept);
  return found;
}

}  // namespace

int run_complete(Arguments words) {
  for (const std::string& word : completions({words.begin() + 1, words.end()})) {
    std::puts(word.c_str());
  }
  return 0;
}

}  // namespace lk::emulator
