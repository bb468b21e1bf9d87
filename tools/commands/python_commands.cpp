#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_quirks.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/core/text.hpp"
#include "emulator/files/profile_files.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/processes.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

// Works as python3 -m, but does not import modules from the working directory, and prints one line
// if a module is missing. Sets PYTHONPATH for the processes that the module starts. Arguments: the
// command, the module, the directory of the package (may be empty).
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

/// Returns the python3 beside the program, else the first one in PATH. A wheel's environment and
/// the system of the Debian package have their Python beside the program.
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

int become(std::vector<std::string> words) {
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execvp(pointers.front(), pointers.data());
  return errno;
}

namespace {

/// Returns a function that replaces this process by `python3 -m MODULE`, with a module of the
/// package lkemu. The module runs this program by the path in $LKEMU.
RunCommand run_module(std::string module, Arguments arguments) {
  return [module = std::move(module), arguments]() -> int {
    const fs::path program = fs::read_symlink("/proc/self/exe");
    const std::string word = arguments.front();
    const std::string python = interpreter(program);
    std::vector<std::string> words = {
        python, "-B", "-c", kStart, word, module, python_directory().string()};
    words.insert(words.end(), arguments.begin() + 1, arguments.end());
    ::setenv("LKEMU", program.c_str(), 1);  // NOLINT(concurrency-mt-unsafe): one thread
    const int error = become(std::move(words));
    throw StartError(word + ": " + python + ": " + std::strerror(error) +
                     (error == ENOENT ? ": apt install python3" : ""));
  };
}

enum class Takes : std::uint8_t { kNothing, kText, kTexts, kTextEachTime, kNumber };

/// An option of a Python command, for the help, the completions and a first check. The Python
/// module parses the arguments again and uses the values.
struct PythonOption {
  const char* names;
  Takes takes;
  const char* type;  // in the help; null: the library's
  std::string about;
  bool required = false;
  int most = 0;  // for a number: allowed are 1..most; 0: any number
};

template <class T>
CLI::Option* add_value(CLI::App& app, const PythonOption& option) {
  return app.add_option_function<T>(
      option.names, [](const T& /*given*/) {}, option.about);
}

CLI::Option* add_option(CLI::App& app, const PythonOption& option) {
  switch (option.takes) {
    case Takes::kNothing:
      return app.add_flag_callback(
          option.names, [] {}, option.about);
    case Takes::kText:
      return add_value<std::string>(app, option);
    case Takes::kTexts:
      return add_value<std::vector<std::string>>(app, option);
    case Takes::kTextEachTime:
      return add_value<std::vector<std::string>>(app, option)->allow_extra_args(false);
    case Takes::kNumber:
      break;
  }
  return add_value<std::uint64_t>(app, option);
}

void add_options(CLI::App& app, const std::vector<PythonOption>& options) {
  for (const PythonOption& option : options) {
    CLI::Option* const added = add_option(app, option)->required(option.required);
    if (option.type != nullptr) added->type_name(option.type);
    if (option.most > 0) added->check(CLI::Range(1, option.most));
  }
}

constexpr const char* kCampaignFooter = R"(
Examples:
  lk-emu campaign every_fault --dry-run                     how many cases, and what they cost
  lk-emu campaign every_fault -o night.db --html night.html
  lk-emu campaign every_fault --case 4711 --csv case.csv    one of them again
  lk-emu campaign every_fault -o part3.db --shard 3/8       and then: lk-emu campaign merge -o night.db part*.db

Exit status: 0 done, 1 a --require does not hold (compare: cases are worse; merge: some are missing), 2 unusable input, 130 interrupted: --resume goes on.

Needs Python 3.11 or newer with scipy, jinja2 and regex:
apt install python3-scipy python3-jinja2 python3-regex.)";

const std::vector<PythonOption>& report_options() {
  static const std::vector<PythonOption> options = {
      {"--html", Takes::kText, "FILE", "write the report as a page"},
      {"--json", Takes::kText, "FILE", "write the report as JSON"},
      {"--junit", Takes::kText, "FILE", "write a test for each kind of fault, as JUnit XML"},
      {"--require", Takes::kTextEachTime, "TEXT",
       "requirement: \"coverage>=0.99\" or \"silently_wrong<=0\" (repeatable)"}};
  return options;
}

void add_subcommands(CLI::App& app) {
  add_options(*app.add_subcommand("merge", "merge the shards of a campaign"),
              {{"-o,--output", Takes::kText, "FILE", "file to write", true},
               {"PART", Takes::kTexts, nullptr, "results files of shards or merges", true}});
  CLI::App* const report = app.add_subcommand("report", "report the results of a campaign");
  const PythonOption results = {"RESULTS", Takes::kText, nullptr, "results file of a campaign",
                                true};
  add_options(*report, {results});
  add_options(*report, report_options());
  add_options(
      *app.add_subcommand("compare", "compare two campaigns case by case, and list what got worse"),
      {{"BEFORE", Takes::kText, nullptr, "earlier results file of the same plan", true},
       {"NOW", Takes::kText, nullptr, "later results file", true},
       {"--html", Takes::kText, "FILE", "write an HTML page, with the report of NOW"},
       {"--json", Takes::kText, "FILE", "write the comparison as JSON"}});
  add_options(
      *app.add_subcommand(
          "export",
          "print all cases as CSV, byte for byte the same for any --jobs, shards and workers"),
      {results});
}

}  // namespace

RunCommand declare_campaign(CLI::App& app, Arguments arguments) {
  app.footer(kCampaignFooter);
  add_options(
      app,
      {{"PLAN", Takes::kText, "PLAN",
        "a plan: a file, or the name of a shipped one (docs/guides/campaigns.md)"},
       {"-o,--output", Takes::kText, "FILE",
        "results, an SQLite file (default: the plan's name, .db)"},
       {.names = "-j,--jobs",
        .takes = Takes::kNumber,
        .type = "N",
        .about = "cases at once (default: number of processors)",
        .most = 1024},
       {"--dask", Takes::kText, "ADDRESS",
        "run the cases on the workers of a dask scheduler: 127.0.0.1:PORT, tls://HOST:PORT"},
       {"--shard", Takes::kText, "I/N",
        "only the cases whose number divided by N leaves I, from 0"},
       {"--resume", Takes::kNothing, nullptr, "resume an existing results file"},
       {"--dry-run", Takes::kNothing, nullptr,
        "print the number of cases by dimension and the cost; run nothing"},
       {"--yes", Takes::kNothing, nullptr, "allow more than 1000 million cases"},
       {"--quiet", Takes::kNothing, nullptr, "print problems only"},
       {"--case", Takes::kNumber, "NUMBER", "run one case and show it"},
       {"--set", Takes::kTextEachTime, "NAME=VALUE", "override a value of this case: NAME=VALUE"},
       {"--csv", Takes::kText, "FILE", "write signals of this case"},
       {"--signals", Takes::kText, "SIGNALS", "signals to write: true_angle_deg,speed_dps,…"},
       {"--rate", Takes::kText, "HZ", "rows per simulated second (default 100)"},
       {"--candump", Takes::kText, "FILE", "write all frames of this case, as candump -L does"},
       {"--scenario", Takes::kText, "FILE", "write this case as a scenario, for lk-emu run"}});
  add_options(app, report_options());
  add_subcommands(app);
  return run_module("lkemu.campaign", arguments);
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

}  // namespace

RunCommand declare_identify(CLI::App& app, Arguments arguments) {
  app.footer(kIdentifyFooter);
  add_options(
      app, {{"LOG", Takes::kTexts, nullptr,
             "log of the running motor, from candump -L or from the script of --plan"},
            {"--motor", Takes::kText, "MOTOR",
             std::string("motor whose gear, encoder and torque constant are used: a name or a file "
                         "(default ") +
                 kDefaultMotor + ")"},
            {"--generation", Takes::kText, "GENERATION",
             "firmware of the drives, one of " + comma_list(generation_words()) +
                 " (default: as the log shows)"},
            {.names = "--id",
             .takes = Takes::kNumber,
             .type = "ID",
             .about = "only this drive (default: all in the log)",
             .most = kMaxId},
            {"-o,--output", Takes::kText, "FILE", "motor file to write"},
            {"--report", Takes::kText, "FILE", "report with plots to write, one HTML file"},
            {"--expect", Takes::kText, "FILE",
             "earlier motor file to compare with; prints what has changed"},
            {"--plan", Takes::kText, "FILE",
             "write a Python script that moves drive --id for 30 s and logs it, instead of reading "
             "a log"}});
  return run_module("lkemu.identify", arguments);
}

namespace {

constexpr const char* kPlotFooter = R"(
Needs Python 3.11 or newer with matplotlib: apt install python3-matplotlib.

Exit status: 0 drawn, 1 failed while running, 2 unusable input, or the picture cannot be written.)";

}  // namespace

RunCommand declare_plot(CLI::App& app, Arguments arguments) {
  app.description("Draw a CSV file of lk-emu run or lk-emu replay as SVG or PNG");
  app.footer(kPlotFooter);
  add_options(app, {{"FILE", Takes::kText, nullptr, "CSV file from --csv", true},
                    {"-o,--output", Takes::kText, "FILE",
                     "picture to write, .svg or .png (default: .svg beside the CSV file)"},
                    {"--bus", Takes::kText, "BUS", "drives of this bus only"},
                    {"--ids", Takes::kText, "LIST",
                     "drives to draw (default: the first six): 1-4 or 1,3,7-9"},
                    {"--lang", Takes::kText, "LANG", kLanguageAbout}});
  return run_module("lkemu.plot", arguments);
}

}  // namespace lk::emulator
