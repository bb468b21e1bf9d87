#include "tools/commands/faults_command.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/io/control/control_json.hpp"
#include "tools/commands/commands.hpp"

namespace lk::emulator {
namespace {

/// Returns text like "jitter_ms 0..10000 (0)", "frames replies|queries|both (replies)".
std::string param_text(const FaultParam& param) {
  if (!param.choices.empty()) {
    return fmt::format("{} {} ({})", param.word, fmt::join(param.choices, "|"),
                       param.choices[static_cast<std::size_t>(param.fallback.choice())]);
  }
  const std::string range = fmt::format("{} {:.9g}..{:.9g}", param.word, param.min, param.max);
  return param.required ? range : range + fmt::format(" ({:g})", param.fallback.number());
}

std::vector<std::string> params_of(const FaultRow& row) {
  std::vector<std::string> texts;
  for (const FaultParam& param : row.params) {
    if (!param.word.empty()) texts.push_back(param_text(param));
  }
  return texts;
}

std::string scope_of(const FaultRow& row) {
  std::string text = row.of_bus ? "bus" : "drives";
  if (row.serial) text += ", RS-485";
  if (row.per_frame) text += ", each frame";
  if (row.momentary()) text += ", at once";
  return text;
}

std::string example(const FaultRow& row) {
  std::string inside = fmt::format("kind = \"{}\"", row.word);
  for (const FaultParam& param : row.params) {
    if (param.required) inside += fmt::format(", {} = {:g}", param.word, std::min(2.0, param.max));
  }
  if (row.needs_one) inside += fmt::format(", {} = 30", row.params[1].word);
  if (row.per_frame) inside += ", probability = 0.1";
  if (!row.momentary()) inside += ", for_s = 0.5";
  return fmt::format("at_s = 2\n{}fault = {{ {} }}\n", row.of_bus ? "" : "id = 1\n", inside);
}

}  // namespace

std::string list_faults() {
  std::string text;
  FaultGroup group{};
  bool first = true;
  for (const FaultRow& row : fault_table()) {
    if (first || row.group != group)
      text += fmt::format("{}{}\n", first ? "" : "\n", to_string(row.group));
    group = row.group;
    first = false;
    text += fmt::format("  {:<20} {}\n", row.word, row.about.en);
    for (const std::string& param : params_of(row))
      text += fmt::format("  {:<20}   {}\n", "", param);
  }
  return text +
         "\nValues in brackets are defaults. For how to set faults see docs/reference/events.md.\n";
}

std::string describe_fault(const FaultRow& row) {
  std::string text = fmt::format("{} ({}; of: {})\n  {}\n", row.word, to_string(row.group),
                                 scope_of(row), row.about.en);
  for (const std::string& param : params_of(row)) text += fmt::format("  {}\n", param);
  return text + "\nas an event of a configuration or scenario:\n" + example(row);
}

std::string fault_page() {
  std::string text;
  FaultGroup group{};
  bool first = true;
  for (const FaultRow& row : fault_table()) {
    if (first || row.group != group) {
      text += fmt::format(
          "\n### {}\n\n| fault | does | parameters (default) | of |\n|---|---|---|---|\n",
          to_string(row.group));
    }
    group = row.group;
    first = false;
    std::string params;
    for (const std::string& param : params_of(row)) {
      std::string cell = param;
      for (std::size_t bar = cell.find('|'); bar != std::string::npos;
           bar = cell.find('|', bar + 2)) {
        cell.replace(bar, 1, "\\|");
      }
      params += (params.empty() ? "" : "<br>") + cell;
    }
    text += fmt::format("| `{}` | {} | {} | {} |\n", row.word, row.about.en, params, scope_of(row));
  }
  return text;
}

namespace {

void print_one(const std::string& word) {
  if (const FaultRow* row = find_fault(word)) {
    std::fputs(describe_fault(*row).c_str(), stdout);
    return;
  }
  std::vector<std::string> words;
  for (const FaultRow& row : fault_table()) words.emplace_back(row.word);
  const std::string meant = closest_match(word, words);
  throw StartError(
      "faults: no fault \"" + word + "\"" +
      (meant.empty() ? " (lk-emu faults lists them)" : ", did you mean " + meant + "?"));
}

constexpr const char* kFaultsFooter = R"(
Exit status: 0 done, 1 it could not be printed, 2 unusable input.)";

}  // namespace

RunCommand declare_faults(CLI::App& app, Arguments /*arguments*/) {
  struct Given {
    std::string word;
    bool markdown = false;
    bool json = false;
  };
  const auto given = std::make_shared<Given>();
  app.footer(kFaultsFooter);
  app.add_option("FAULT", given->word, "fault to show");
  app.add_flag("--json", given->json, "print all faults with their parameters as JSON");
  app.add_flag("--markdown", given->markdown,
               "print all faults as tables for docs/reference/events.md");
  return [given] {
    if (given->markdown) {
      std::fputs(fault_page().c_str(), stdout);
    } else if (given->json) {
      std::fputs((fault_kinds_json().dump(1) + '\n').c_str(), stdout);
    } else if (given->word.empty()) {
      std::fputs(list_faults().c_str(), stdout);
    } else {
      print_one(given->word);
    }
    return 0;
  };
}

}  // namespace lk::emulator
