#include "tools/commands/python_commands.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_quirks.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/core/text.hpp"
#include "emulator/files/profile_files.hpp"
#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/language_option.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

// As python3 -m, but without modules of the working directory, and with one line for what is
// missing. PYTHONPATH is for the processes that the module starts. Arguments: the command, the
// module, the directory of the package or nothing.
constexpr const char* kStart = R"(import importlib.util, os, runpy, sys
command, module, directory = sys.argv[1:4]
del sys.argv[1:4]
sys.path = [directory] * bool(directory) + [place for place in sys.path if place]
problem = ""
if sys.version_info < (3, 11):
    problem = "Python 3.11 or newer; %s is %d.%d" % (sys.executable, *sys.version_info[:2])
elif importlib.util.find_spec("lkemu") is None:
    problem = ("the Python package lkemu, which %s does not have: install the .deb or the wheel of lk-emu, "
               "or keep share/lk-emu of the tarball beside bin" % sys.executable)
if problem:
    sys.stderr.write("lk-emu: %s: needs %s\n" % (command, problem))
    sys.exit(2)
from lkemu.command import check_libraries
check_libraries(command)
if directory:
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [directory, os.environ.get("PYTHONPATH")]))
runpy.run_module(module, run_name="__main__", alter_sys=True)
)";

/// The Python of the environment that a wheel was installed into, or of the system that the Debian
/// package belongs to, stands beside the program; else the first one in PATH.
std::string interpreter(const fs::path& program) {
  const fs::path beside = program.parent_path() / "python3";
  return ::access(beside.c_str(), X_OK) == 0 ? beside.string() : "python3";
}

}  // namespace

fs::path python_directory() {
  std::error_code none_there;
  const fs::path installed = config_directory() / "python";
  if (fs::exists(installed / "lkemu", none_there)) return installed;
  // In a build tree config_directory() is a link to the configs of the sources.
  const fs::path sources = fs::weakly_canonical(config_directory(), none_there).parent_path();
  return fs::exists(sources / "python/lkemu", none_there) ? sources / "python" : fs::path();
}

void become_python(const std::string& module, int argc, const char* const* argv) {
  const fs::path program = fs::read_symlink("/proc/self/exe");
  std::vector<std::string> words = {interpreter(program),       "-B", "-c", kStart, argv[0], module,
                                    python_directory().string()};
  words.insert(words.end(), argv + 1, argv + argc);
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::setenv("LKEMU", program.c_str(), 1);  // NOLINT(concurrency-mt-unsafe): one thread
  ::execvp(pointers.front(), pointers.data());
  const int error = errno;
  throw StartError(std::string(argv[0]) + ": " + words.front() + ": " + std::strerror(error) +
                   (error == ENOENT ? ": apt install python3" : ""));
}

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
  CLI::App app{"Run many cases of a scenario with faults, and report the results",
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
    CLI::App* const merge = app.add_subcommand("merge", "merge the shards of a campaign");
    merge->add_option("-o,--output", text, "file to write")->required()->type_name("FILE");
    merge->add_option("PART", texts, "results files of shards or merges")->required();
    CLI::App* const report = app.add_subcommand("report", "report the results of a campaign");
    report->add_option("RESULTS", text, "results file of a campaign")->required();
    add_report_options(*report);
    CLI::App* const compare = app.add_subcommand(
        "compare", "compare two campaigns case by case, and list what got worse");
    compare->add_option("BEFORE", text, "earlier results file of the same plan")->required();
    compare->add_option("NOW", text, "later results file")->required();
    compare->add_option("--html", text, "write an HTML page, with the report of NOW")
        ->type_name("FILE");
    compare->add_option("--json", text, "write the comparison as JSON")->type_name("FILE");
    CLI::App* const canonical = app.add_subcommand(
        "export",
        "print all cases as CSV, byte for byte the same for any --jobs, shards and workers");
    canonical->add_option("RESULTS", text, "results file of a campaign")->required();
  }

 private:
  void add_run_options() {
    app.add_option("PLAN", text,
                   "a plan: a file, or the name of a shipped one (docs/guides/campaigns.md)")
        ->type_name("PLAN");
    app.add_option("-o,--output", text, "results, an SQLite file (default: the plan's name, .db)")
        ->type_name("FILE");
    app.add_option("-j,--jobs", jobs, "cases at once (default: number of processors)")
        ->check(CLI::Range(1, 1024))
        ->type_name("N");
    app.add_option(
           "--dask", text,
           "run the cases on the workers of a dask scheduler: 127.0.0.1:PORT, tls://HOST:PORT")
        ->type_name("ADDRESS");
    app.add_option("--shard", text, "only the cases whose number divided by N leaves I, from 0")
        ->type_name("I/N");
    app.add_flag("--resume", flag, "resume an existing results file");
    app.add_flag("--dry-run", flag,
                 "print the number of cases by dimension and the cost; run nothing");
    app.add_flag("--yes", flag, "allow more than 1000 million cases");
    app.add_flag("--quiet", flag, "print problems only");
  }
  void add_case_options() {
    app.add_option("--case", number, "run one case and show it")->type_name("NUMBER");
    app.add_option("--set", texts, "override a value of this case: NAME=VALUE")
        ->allow_extra_args(false)
        ->type_name("NAME=VALUE");
    app.add_option("--csv", text, "write signals of this case")->type_name("FILE");
    app.add_option("--signals", text, "signals to write: true_angle_deg,speed_dps,…")
        ->type_name("SIGNALS");
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
                  "requirement: \"coverage>=0.99\" or \"silently_wrong<=0\" (repeatable)")
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

namespace {

constexpr const char* kIdentifyFooter = R"(
Example of an experiment, and of a comparison with it later:
  lk-emu identify --plan excite.py --motor mg4005 --id 1
  python3 excite.py --interface socketcan --channel can0 --log my_motor.log
  lk-emu identify my_motor.log --motor mg4005 -o my_motor.toml --report my_motor.html
  lk-emu identify may.log --motor mg4005 --expect my_motor.toml

Needs Python 3.11 or newer with numpy and scipy, and matplotlib for --report:
apt install python3-numpy python3-scipy python3-matplotlib.

Exit status: 0 done, 1 a value differs from --expect, 2 unusable input.)";

/// The options of python/lkemu/identify, for the help, the completions and their check.
struct IdentifyApp {
  CLI::App app{"Estimate a motor's parameters from its logs, and write a motor file",
               "lk-emu identify"};
  std::vector<std::string> logs;
  std::string given;
  int id = 0;

  IdentifyApp() {
    app.footer(kIdentifyFooter);
    app.add_option("LOG", logs,
                   "log of the running motor, from candump -L or from the script of --plan");
    app.add_option("--motor", given,
                   std::string("motor whose gear, encoder and torque constant are used: a name or "
                               "a file (default ") +
                       kDefaultMotor + ")")
        ->type_name("MOTOR");
    app.add_option("--generation", given,
                   "firmware of the drives, one of " + comma_list(generation_words()) +
                       " (default: as the log shows)")
        ->type_name("GENERATION");
    app.add_option("--id", id, "only this drive (default: all in the log)")
        ->type_name("ID")
        ->check(CLI::Range(1, kMaxId));
    app.add_option("-o,--output", given, "motor file to write")->type_name("FILE");
    app.add_option("--report", given, "report with plots to write, one HTML file")
        ->type_name("FILE");
    app.add_option("--expect", given, "earlier motor file to compare with; prints what has changed")
        ->type_name("FILE");
    app.add_option("--plan", given,
                   "write a Python script that moves drive --id for 30 s and logs it, instead of "
                   "reading a log")
        ->type_name("FILE");
  }
};

}  // namespace

std::shared_ptr<CLI::App> identify_app() {
  const auto made = std::make_shared<IdentifyApp>();
  return {made, &made->app};
}

int run_identify(int argc, const char* const* argv) {
  IdentifyApp given;
  if (!parse_arguments(given.app, argc, argv)) return 0;
  become_python("lkemu.identify", argc, argv);
}

namespace {

constexpr const char* kPlotFooter = R"(
Needs Python 3.11 or newer with matplotlib: apt install python3-matplotlib.

Exit status: 0 drawn, 1 failed while running, 2 unusable input, or the picture cannot be written.)";

/// The options of python/lkemu/plot.py, for the help, the completions and their check.
struct PlotApp {
  CLI::App app{"Draw a CSV file of lk-emu run or lk-emu replay as SVG or PNG", "lk-emu plot"};
  std::string given;
  std::string language;

  PlotApp() {
    app.footer(kPlotFooter);
    app.add_option("FILE", given, "CSV file from --csv")->required();
    app.add_option("-o,--output", given,
                   "picture to write, .svg or .png (default: .svg beside the CSV file)")
        ->type_name("FILE");
    app.add_option("--bus", given, "drives of this bus only")->type_name("BUS");
    app.add_option("--ids", given, "drives to draw (default: the first six): 1-4 or 1,3,7-9")
        ->type_name("LIST");
    add_language_option(app, language);
  }
};

}  // namespace

std::shared_ptr<CLI::App> plot_app() {
  const auto made = std::make_shared<PlotApp>();
  return {made, &made->app};
}

int run_plot(int argc, const char* const* argv) {
  PlotApp given;
  if (!parse_arguments(given.app, argc, argv)) return 0;
  become_python("lkemu.plot", argc, argv);
}

}  // namespace lk::emulator
