#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/monitor/scenario/csv_writer.hpp"
#include "emulator/monitor/scenario/scenario_report.hpp"
#include "emulator/monitor/scenario/scenario_runner.hpp"
#include "tools/cases/case_stream.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/commands.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kRunFooter = R"(
Exit status: 0 all passed, 1 an expectation failed (or advice was given, with --strict), or the report could not be printed, 2 unusable
input, 3 invalid: a planned fault never took effect, so the run says nothing. Of several scenarios the worst counts: 2, 1, 3, 0.)";

/// Values of the options, as CLI11 stores them.
struct RawRun {
  std::vector<std::string> files;
  std::string seed;
  std::string junit, csv, candump, capture, rom, ids;
  std::vector<std::string> signals;
  double rate_Hz = 100;
  bool marks = false;
  bool quiet = false;
  bool strict = false;
  std::string language;
  CaseInput cases;
};

void add_options(CLI::App& app, RawRun& raw) {
  app.add_option("SCENARIO", raw.files,
                 "scenarios to run: files, or names of shipped ones (docs/guides/scenarios.md)");
  app.add_option("--seed", raw.seed, "seed to use instead of the scenario's")->type_name("N");
  app.add_option("--junit", raw.junit, "write the verdicts as JUnit XML")->type_name("FILE");
  app.add_option("--csv", raw.csv, "write signals of one scenario")->type_name("FILE");
  app.add_option("--signals", raw.signals, "signals to write: angle_deg,speed_dps,…")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("SIGNALS");
  app.add_option("--ids", raw.ids, "drives to write (default all): 1-4 or 1,3,7-9")
      ->type_name("LIST");
  app.add_option("--rate", raw.rate_Hz, "rows per simulated second (default 100)")->type_name("HZ");
  app.add_option("--candump", raw.candump, "write all frames of one scenario as candump -L does")
      ->type_name("FILE");
  app.add_flag("--marks", raw.marks, "mark the lines of --candump: T from a host, R from a drive");
  app.add_option("--capture", raw.capture,
                 "write all frames of one scenario as pcapng, for Wireshark")
      ->type_name("FILE");
  app.add_option("--rom", raw.rom, "directory for the ROM of the drives (default: keep nothing)")
      ->type_name("DIR");
  app.add_flag("--strict", raw.strict,
               "fail if there is advice about the host (docs/guides/host-mistakes.md)");
  add_language_option(app, raw.language);
  app.add_flag("--quiet", raw.quiet, "print only scenarios that did not pass");
  app.add_option(
         "--cases", raw.cases.file,
         "run cases, a JSON object each line, \"-\": standard input (docs/reference/formats.md)")
      ->type_name("FILE");
  app.add_option("--jobs", raw.cases.jobs, "threads for --cases (default 1)")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  app.add_flag("--check", raw.cases.check, "check --cases without running them");
  app.add_option("--scenario", raw.cases.scenario,
                 "write the case of --cases, which must be the only one, as a scenario")
      ->type_name("FILE");
}

RunOutputs::Csv read_csv(const RawRun& raw) {
  RunOutputs::Csv csv;
  csv.file = raw.csv;
  csv.period = row_period(raw.rate_Hz);
  if (!raw.signals.empty()) csv.signals = raw.signals;
  if (raw.ids.empty()) return csv;
  try {
    csv.ids = parse_ids(raw.ids);
  } catch (const std::invalid_argument& problem) {
    throw StartError(std::string("--ids: ") + problem.what());
  }
  return csv;
}

RunOutputs read_outputs(const CLI::App& app, const RawRun& raw) {
  RunOutputs outputs;
  if (raw.csv.empty()) {
    refuse_options(app, {"--signals", "--ids", "--rate"}, "{}: belongs to --csv");
  }
  if (app.count("--candump") == 0) refuse_options(app, {"--marks"}, "{}: belongs to --candump");
  if (raw.files.size() > 1) {
    refuse_options(app, {"--csv", "--candump", "--capture"}, "{}: takes one scenario at a time");
  }
  if (app.count("--csv") > 0) outputs.csv = read_csv(raw);
  if (app.count("--candump") > 0) outputs.frames.candump = raw.candump;
  if (app.count("--capture") > 0) outputs.frames.capture = raw.capture;
  outputs.frames.marks = raw.marks;
  if (app.count("--rom") > 0 && raw.rom != ":memory:") outputs.rom = raw.rom;
  outputs.strict = raw.strict;
  outputs.progress = !raw.quiet && ::isatty(STDERR_FILENO) != 0;
  return outputs;
}

std::optional<std::uint64_t> read_seed(const CLI::App& app, const RawRun& raw) {
  if (app.count("--seed") == 0) return std::nullopt;
  std::int64_t seed = 0;
  const char* const last = raw.seed.data() + raw.seed.size();
  const auto [end, error] = std::from_chars(raw.seed.data(), last, seed);
  if (seed < 0) throw StartError("--seed: must not be negative");
  if (error != std::errc() || end != last) {
    throw StartError("--seed: \"" + raw.seed + "\" is not a whole number from 0 to 2^63 - 1");
  }
  return static_cast<std::uint64_t>(seed);
}

/// Returns true on a terminal, unless NO_COLOR is set (no-color.org).
bool in_colour() {
  const char* const refused = std::getenv("NO_COLOR");
  return ::isatty(STDOUT_FILENO) != 0 && (refused == nullptr || *refused == '\0');
}

/// Returns text like "4 scenarios: 2 passed, 1 failed, 1 invalid".
std::string count_text(const std::vector<RunReport>& reports) {
  const auto count = [&](Outcome outcome) {
    return std::ranges::count(reports, outcome, &RunReport::outcome);
  };
  std::string text = std::to_string(reports.size()) + " scenarios";
  const char* separator = ": ";
  for (const auto& [outcome, word] :
       {std::pair(Outcome::kPassed, "passed"), std::pair(Outcome::kFailed, "failed"),
        std::pair(Outcome::kInvalid, "invalid")}) {
    if (count(outcome) == 0) continue;
    text += separator + std::to_string(count(outcome)) + ' ' + word;
    separator = ", ";
  }
  return text + '\n';
}

Outcome worse(Outcome a, Outcome b) {
  if (a == Outcome::kFailed || b == Outcome::kFailed) return Outcome::kFailed;
  return a == Outcome::kPassed ? b : a;
}

int run(const CLI::App& app, const RawRun& raw) {
  if (app.count("--cases") > 0) {
    refuse_options(app,
                   {"SCENARIO", "--seed", "--junit", "--csv", "--candump", "--capture", "--rom",
                    "--strict", "--quiet"},
                   "{}: not together with --cases");
    return run_cases(raw.cases) ? 0 : 1;
  }
  refuse_options(app, {"--jobs", "--check", "--scenario"}, "{}: belongs to --cases");
  if (raw.files.empty()) throw StartError("run: SCENARIO is required");
  const std::optional<std::uint64_t> seed = read_seed(app, raw);
  const RunOutputs outputs = read_outputs(app, raw);
  const Language language = chosen_language(raw.language);
  // Loads all scenarios first, so that input errors are found before anything runs.
  std::vector<Scenario> scenarios;
  for (const std::string& file : raw.files) scenarios.push_back(load_scenario(file, seed));
  std::optional<OutputFile> junit;
  if (app.count("--junit") > 0) junit.emplace(raw.junit, "--junit");
  std::vector<RunReport> reports;
  Outcome outcome = Outcome::kPassed;
  for (Scenario& scenario : scenarios) {
    reports.push_back(run_scenario(std::move(scenario), outputs));
    const RunReport& report = reports.back();
    outcome = worse(outcome, report.outcome());
    if (raw.quiet && report.outcome() == Outcome::kPassed) continue;
    std::fputs(report_text(report, in_colour(), language).c_str(), stdout);
    std::fflush(stdout);
  }
  const bool print_counts = !raw.quiet || outcome != Outcome::kPassed;
  if (reports.size() > 1 && print_counts) std::fputs(count_text(reports).c_str(), stdout);
  if (junit) {
    junit->write(junit_xml(reports));
    junit->commit();
  }
  return exit_status(outcome);
}

}  // namespace

RunCommand declare_run(CLI::App& app, Arguments /*arguments*/) {
  const auto raw = std::make_shared<RawRun>();
  app.footer(kRunFooter);
  add_options(app, *raw);
  return [raw, &app] { return run(app, *raw); };
}

}  // namespace lk::emulator
