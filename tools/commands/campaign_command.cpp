#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/python_package.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kCampaignFooter = R"(
Examples:
  lk-emu campaign every_fault --dry-run                     how many cases, and what they cost
  lk-emu campaign every_fault -o night.db --html night.html
  lk-emu campaign every_fault --case 4711 --csv case.csv    one of them again
  lk-emu campaign every_fault -o part3.db --shard 3/8       and then: lk-emu campaign merge -o night.db part*.db

Exit status: 0 done, 1 a --require does not hold (compare: cases are worse; merge: some are missing), 2 unusable input, 130 interrupted: --resume goes on.

Needs Python 3.11 or newer with scipy, jinja2 and regex:
apt install python3-scipy python3-jinja2 python3-regex.)";

/// The options of python/lkemu/campaign, for the help, the completions and their check.
struct CampaignApp {
  CLI::App app{"Run many cases of a scenario with faults, and tell what came of them",
               "lk-emu campaign"};
  std::string text;
  std::vector<std::string> texts;
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  std::uint64_t number = 0;
  bool flag = false;

  CampaignApp() {
    app.footer(kCampaignFooter);
    add_run_options();
    add_case_options();
    add_report_options(app);
    CLI::App* const merge = app.add_subcommand("merge", "put the shards of a campaign together");
    merge->add_option("-o,--output", text, "the new file")->required()->type_name("FILE");
    merge->add_option("PART", texts, "files of shards, or of merges")->required();
    CLI::App* const report = app.add_subcommand("report", "tell what came of a campaign");
    report->add_option("RESULTS", text, "the file of a campaign")->required();
    add_report_options(*report);
    CLI::App* const compare =
        app.add_subcommand("compare", "tell what is worse than before, case by case");
    compare->add_option("BEFORE", text, "the file of an earlier campaign of the plan")->required();
    compare->add_option("NOW", text, "the file of a later one")->required();
    compare->add_option("--html", text, "write a page, with the report of NOW")->type_name("FILE");
    compare->add_option("--json", text, "write the comparison as JSON")->type_name("FILE");
    CLI::App* const canonical = app.add_subcommand(
        "export", "print all cases as CSV: the same bytes whoever computed them");
    canonical->add_option("RESULTS", text, "the file of a campaign")->required();
  }

 private:
  void add_run_options() {
    app.add_option("PLAN", text, "a plan: a file, or the name of a shipped one (docs/campaigns.md)")
        ->type_name("PLAN");
    app.add_option("-o,--output", text, "results, an SQLite file (default: the plan's name, .db)")
        ->type_name("FILE");
    app.add_option("-j,--jobs", jobs, "cases at once (default: as many as there are processors)")
        ->check(CLI::Range(1, 1024))
        ->type_name("N");
    app.add_option(
           "--dask", text,
           "run the cases on the workers of a dask scheduler: 127.0.0.1:PORT, tls://HOST:PORT")
        ->type_name("ADDRESS");
    app.add_option("--shard", text, "only the cases whose number divided by N leaves I, from 0")
        ->type_name("I/N");
    app.add_flag("--resume", flag, "go on with a file that is there");
    app.add_flag("--dry-run", flag, "tell the cases, what each dimension gives, and the cost");
    app.add_flag("--yes", flag, "more than 1000 million cases are meant");
    app.add_flag("--quiet", flag, "print nothing but what is wrong");
  }
  void add_case_options() {
    app.add_option("--case", number, "run one case and show it")->type_name("NUMBER");
    app.add_option("--set", texts, "of this case: NAME=VALUE in place of what it has")
        ->allow_extra_args(false)
        ->type_name("NAME=VALUE");
    app.add_option("--csv", text, "write signals of this case")->type_name("FILE");
    app.add_option("--signals", text, "which: true_angle_deg,speed_dps,…")->type_name("SIGNALS");
    app.add_option("--rate", text, "rows per simulated second (default 100)")->type_name("HZ");
    app.add_option("--candump", text, "write all frames of this case, as candump -L does")
        ->type_name("FILE");
    app.add_option("--scenario", text, "write this case as a scenario, for lk-emu run")
        ->type_name("FILE");
  }
  void add_report_options(CLI::App& to) {
    to.add_option("--html", text, "write the report as a page")->type_name("FILE");
    to.add_option("--json", text, "write the report as JSON")->type_name("FILE");
    to.add_option("--junit", text, "write a test for each kind of fault, as JUnit XML")
        ->type_name("FILE");
    to.add_option("--require", texts,
                  "what must hold, \"coverage>=0.99\" or \"silently_wrong<=0\"; may be given again")
        ->allow_extra_args(false)
        ->type_name("TEXT");
  }
};

}  // namespace

std::shared_ptr<CLI::App> campaign_app() {
  const auto made = std::make_shared<CampaignApp>();
  return {made, &made->app};
}

int run_campaigns(int argc, const char* const* argv) {
  CampaignApp given;
  if (!parse_arguments(given.app, argc, argv)) return 0;
  become_python("lkemu.campaign", argc, argv);
}

}  // namespace lk::emulator
