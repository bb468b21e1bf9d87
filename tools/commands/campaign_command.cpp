#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "emulator/config/config_error.hpp"
#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"
#include "tools/campaign/plan/plan_file.hpp"
#include "tools/campaign/results/canonical.hpp"
#include "tools/campaign/results/merge.hpp"
#include "tools/commands/campaign_actions.hpp"
#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCampaignFooter = R"(
Examples:
  lk-emu campaign every_fault --dry-run                     how many cases, and what they cost
  lk-emu campaign every_fault -o night.db --html night.html
  lk-emu campaign every_fault --case 4711 --csv case.csv    one of them again
  lk-emu campaign every_fault -o part3.db --shard 3/8       and then: lk-emu campaign merge -o night.db part*.db

Exit status: 0 done, 1 a --require does not hold (compare: cases are worse; merge: some are missing), 2 unusable input, 130 interrupted: --resume goes on.)";

struct CampaignApp {
  CLI::App app{"Run many cases of a scenario with faults, and tell what came of them",
               "lk-emu campaign"};
  std::string plan, output, shard, after, number;
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  bool resume = false, dry_run = false, yes = false, quiet = false;
  CaseOutputs one;
  std::vector<std::string> signals;
  CampaignReports reports;
  std::vector<std::string> parts;
  std::string store, before;
  CLI::App *merge = nullptr, *report = nullptr, *compare = nullptr, *canonical = nullptr;

  CampaignApp() {
    app.footer(kCampaignFooter);
    add_run_options();
    add_case_options();
    add_report_options(app);
    merge = app.add_subcommand("merge", "put the shards of a campaign together");
    merge->add_option("-o,--output", output, "the new file")->required()->type_name("FILE");
    merge->add_option("PART", parts, "files of shards, or of merges")->required();
    report = app.add_subcommand("report", "tell what came of a campaign");
    report->add_option("RESULTS", store, "the file of a campaign")->required();
    add_report_options(*report);
    compare = app.add_subcommand("compare", "tell what is worse than before, case by case");
    compare->add_option("BEFORE", before, "the file of an earlier campaign of the plan")
        ->required();
    compare->add_option("NOW", store, "the file of a later one")->required();
    compare->add_option("--html", reports.html, "write a page, with the report of NOW")
        ->type_name("FILE");
    compare->add_option("--json", reports.json, "write the comparison as JSON")->type_name("FILE");
    canonical = app.add_subcommand("export",
                                   "print all cases as CSV: the same bytes whoever computed them");
    canonical->add_option("RESULTS", store, "the file of a campaign")->required();
  }

 private:
  void add_run_options() {
    app.add_option("PLAN", plan,
                   "a plan: a file, or the name of a shipped one (docs/campaigns.md)");
    app.add_option("-o,--output", output, "results, an SQLite file (default: the plan's name, .db)")
        ->type_name("FILE");
    app.add_option("-j,--jobs", jobs, "cases at once (default: as many as there are processors)")
        ->check(CLI::Range(1, 1024))
        ->type_name("N");
    app.add_option("--shard", shard, "only the cases whose number divided by N leaves I, from 0")
        ->type_name("I/N");
    app.add_option("--after", after,
                   "of adaptive, whose shards are its generations: the results of those before")
        ->type_name("FILE");
    app.add_flag("--resume", resume, "go on with a file that is there");
    app.add_flag("--dry-run", dry_run, "tell the cases, what each dimension gives, and the cost");
    app.add_flag("--yes", yes, "more than 1000 million cases are meant");
    app.add_flag("--quiet", quiet, "print nothing but what is wrong");
  }
  void add_case_options() {
    app.add_option("--case", number, "run one case and show it")->type_name("NUMBER");
    app.add_option("--set", one.set, "of this case: NAME=VALUE in place of what it has")
        ->allow_extra_args(false)
        ->type_name("NAME=VALUE");
    app.add_option("--csv", one.csv, "write signals of this case")->type_name("FILE");
    app.add_option("--signals", one.signals, "which: true_angle_deg,speed_dps,…")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->type_name("SIGNALS");
    app.add_option("--rate", one.rate_Hz, "rows per simulated second (default 100)")
        ->type_name("HZ");
    app.add_option("--candump", one.candump, "write all frames of this case, as candump -L does")
        ->type_name("FILE");
    app.add_option("--scenario", one.scenario, "write this case as a scenario, for lk-emu run")
        ->type_name("FILE");
  }
  void add_report_options(CLI::App& to) {
    to.add_option("--html", reports.html, "write the report as a page")->type_name("FILE");
    to.add_option("--json", reports.json, "write the report as JSON")->type_name("FILE");
    to.add_option("--junit", reports.junit, "write a test for each kind of fault, as JUnit XML")
        ->type_name("FILE");
    to.add_option("--require", reports.require,
                  "what must hold, \"coverage>=0.99\" or \"silently_wrong<=0\"; may be given again")
        ->allow_extra_args(false)
        ->type_name("TEXT");
  }
};

std::optional<std::uint64_t> read_number(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

Shard read_shard(const std::string& text) {
  const std::size_t slash = text.find('/');
  const auto index = read_number(std::string_view(text).substr(0, slash));
  const auto of = slash == std::string::npos
                      ? std::nullopt
                      : read_number(std::string_view(text).substr(slash + 1));
  if (!index || !of || *index >= *of || *of > kMostShards) {
    throw StartError("--shard: \"" + on_one_line(text) +
                     "\" is none; of 8 shards the first is 0/8, the last 7/8");
  }
  return {*index, *of};
}

/// Options that make no sense together, in one line.
void check_options(const CLI::App& app) {
  for (const char* option : {"--set", "--csv", "--signals", "--rate", "--candump", "--scenario"}) {
    if (app.count(option) > 0 && app.count("--case") == 0) {
      throw StartError(std::string(option) + ": belongs to --case");
    }
  }
  for (const char* option : {"--signals", "--rate"}) {
    if (app.count(option) > 0 && app.count("--csv") == 0) {
      throw StartError(std::string(option) + ": belongs to --csv");
    }
  }
  for (const char* first : {"--case", "--dry-run"}) {
    if (app.count(first) == 0) continue;
    for (const char* option : {"--resume", "--shard", "--html", "--json", "--junit", "--require"}) {
      if (app.count(option) > 0) {
        throw StartError(std::string(option) + ": does not go together with " + first);
      }
    }
  }
}

/// A word as a shell takes it, quoted where it has to be.
std::string shell_word(const std::string& word) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+=./:,@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

/// What goes on with a campaign that was begun with these words.
std::string resuming_command(int argc, const char* const* argv, bool resumes_already) {
  std::string command = "lk-emu campaign";
  for (int n = 1; n < argc; ++n) command += " " + shell_word(argv[n]);
  return on_one_line(command + (resumes_already ? "" : " --resume"));
}

int run_plan(const CampaignApp& given, const std::string& resuming) {
  const CLI::App& app = given.app;
  if (given.plan.empty()) throw StartError("which plan? (see lk-emu campaign --help)");
  check_options(app);
  const Plan plan = load_plan(given.plan);
  const fs::path store = given.output.empty() ? plan.head.plan_name + ".db" : given.output;
  if (app.count("--case") > 0) {
    const auto number = read_number(given.number);
    if (!number) throw StartError("--case: \"" + on_one_line(given.number) + "\" is no number");
    return show_case(plan, *number, store, given.one);
  }
  if (given.dry_run) return tell_cost(plan, given.jobs);
  constexpr std::uint64_t kMany = 1'000'000'000;
  if (plan.head.numbers > kMany && !given.yes) {
    throw StartError(
        plan.file.string() + ": has " + std::to_string(plan.head.numbers) +
        " cases, more than 1000 million; --yes if they are meant, --dry-run tells why");
  }
  CampaignRequest request;
  request.store = store;
  request.resuming = resuming;
  request.after = given.after;
  request.resume = given.resume;
  request.options.jobs = given.jobs;
  if (!given.shard.empty()) request.options.shard = read_shard(given.shard);
  request.options.progress = !given.quiet && ::isatty(STDERR_FILENO) != 0;
  request.quiet = given.quiet;
  request.reports = given.reports;
  return run_and_report(plan, request);
}

int run_given(const CampaignApp& given, const std::string& resuming) {
  if (given.merge->parsed()) {
    const std::vector<fs::path> parts(given.parts.begin(), given.parts.end());
    const MergeSummary merged = merge_campaigns(given.output, parts);
    std::printf("%s: %s\n", on_one_line(given.output).c_str(), merged.text().c_str());
    return merged.is_whole ? 0 : 1;
  }
  if (given.report->parsed()) return report_results(given.store, given.reports, false);
  if (given.compare->parsed()) return compare_results(given.before, given.store, given.reports);
  if (given.canonical->parsed()) {
    export_canonical(CampaignStore::read(given.store), [](std::string_view text) {
      std::fwrite(text.data(), 1, text.size(), stdout);
    });
    return 0;
  }
  return run_plan(given, resuming);
}

}  // namespace

std::shared_ptr<CLI::App> campaign_app() {
  const auto made = std::make_shared<CampaignApp>();
  return {made, &made->app};
}

int run_campaigns(int argc, const char* const* argv) {
  CampaignApp given;
  if (!parse_arguments(given.app, argc, argv)) return 0;
  try {
    return run_given(given, resuming_command(argc, argv, given.resume));
  } catch (const ConfigError& problem) {
    throw StartError(problem.what());
  }
}

}  // namespace lk::emulator
