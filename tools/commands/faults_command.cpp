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

/// Returns text like "jitter_ms 0..10000 (0)", "frames replies|queries|both (replies)". `bar` is
/// the separator of choices.
std::string param_text(const FaultParam& param, std::string_view bar) {
  if (!param.choices.empty()) {
    return fmt::format("{} {} ({})", param.word, fmt::join(param.choices, bar),
                       param.choices[static_cast<std::size_t>(param.fallback.choice())]);
  }
  const std::string range = fmt::format("{} {:.9g}..{:.9g}", param.word, param.min, param.max);
  return param.required ? range : range + fmt::format(" ({:g})", param.fallback.number());
}

std::vector<std::string> params_of(const FaultRow& row, std::string_view bar = "|") {
  std::vector<std::string> texts;
  for (const FaultParam& param : row.params) {
    if (!param.word.empty()) texts.push_back(param_text(param, bar));
  }
  return texts;
}

/// Returns the text of all faults, with a heading before each group.
std::string grouped(std::string (*heading)(FaultGroup group),
                    std::string (*text)(const FaultRow&)) {
  std::string all;
  const FaultRow* before = nullptr;
  for (const FaultRow& row : fault_table()) {
    if (before == nullptr || row.group != before->group) all += heading(row.group);
    all += text(row);
    before = &row;
  }
  return all;
}

std::string scope_of(const FaultRow& row) {
  std::string text = row.of_bus ? "bus" : "drives";
  if (row.serial) text += ", RS-485";
  if (row.can) text += ", CAN";
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
  const std::string groups =
      grouped([](FaultGroup group) { return fmt::format("\n{}\n", to_string(group)); },
              [](const FaultRow& row) {
                std::string text = fmt::format("  {:<20} {}\n", row.word, row.about.en);
                for (const std::string& param : params_of(row)) {
                  text += fmt::format("  {:<20}   {}\n", "", param);
                }
                return text;
              });
  return groups.substr(1) +  // without the line before the first group
         "\nValues in brackets are defaults. For how to set faults see docs/reference/events.md.\n";
}

std::string describe_fault(const FaultRow& row) {
  std::string text = fmt::format("{} ({}; of: {})\n  {}\n", row.word, to_string(row.group),
                                 scope_of(row), row.about.en);
  for (const std::string& param : params_of(row)) text += fmt::format("  {}\n", param);
  return text + "\nas an event of a configuration or scenario:\n" + example(row);
}

std::string fault_page() {
  return grouped(
      [](FaultGroup group) {
        return fmt::format(
            "\n### {}\n\n| fault | does | parameters (default) | of |\n|---|---|---|---|\n",
            to_string(group));
      },
      [](const FaultRow& row) {
        return fmt::format("| `{}` | {} | {} | {} |\n", row.word, row.about.en,
                           fmt::join(params_of(row, "\\|"), "<br>"), scope_of(row));
      });
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
