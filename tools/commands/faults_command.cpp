#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "emulator/config/config_reader.hpp"
#include "emulator/control/control_json.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/ground/start_error.hpp"
#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/fault_listing.hpp"

namespace lk::emulator {
namespace {

void print_one(const std::string& word) {
  if (const FaultRow* row = find_fault(word)) {
    std::fputs(describe_fault(*row).c_str(), stdout);
    return;
  }
  std::vector<std::string> words;
  for (const FaultRow& row : fault_table()) words.emplace_back(row.word);
  const std::string meant = nearest(word, words);
  throw StartError(
      "faults: no fault \"" + word + "\"" +
      (meant.empty() ? " (lk-emu faults lists them)" : ", did you mean " + meant + "?"));
}

constexpr const char* kFaultsFooter = R"(
Exit status: 0 done, 1 it could not be printed, 2 unusable input.)";

struct FaultsApp {
  CLI::App app{"List the faults that can be injected, or show one of them", "lk-emu faults"};
  std::string word;
  bool markdown = false;
  bool json = false;

  FaultsApp() {
    app.footer(kFaultsFooter);
    app.add_option("FAULT", word, "fault to show");
    app.add_flag("--json", json, "print all faults with their parameters as JSON");
    app.add_flag("--markdown", markdown, "as the page docs/faults.md has them");
  }
};

}  // namespace

std::shared_ptr<CLI::App> faults_app() {
  const auto made = std::make_shared<FaultsApp>();
  return {made, &made->app};
}

int run_faults(int argc, const char* const* argv) {
  FaultsApp given;
  if (!parse_arguments(given.app, argc, argv)) return 0;
  if (given.markdown) {
    std::fputs(fault_page().c_str(), stdout);
  } else if (given.json) {
    std::fputs((fault_kinds_json().dump(1) + '\n').c_str(), stdout);
  } else if (given.word.empty()) {
    std::fputs(list_faults().c_str(), stdout);
  } else {
    print_one(given.word);
  }
  return 0;
}

}  // namespace lk::emulator
