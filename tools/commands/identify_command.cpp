#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_quirks.hpp"
#include "emulator/ground/text.hpp"
#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/python_package.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kIdentifyFooter = R"(
Example, at the motor and after it:
  lk-emu identify --plan excite.py --motor mg4005 --id 1
  python3 excite.py --interface socketcan --channel can0 --log my_motor.log
  lk-emu identify my_motor.log --motor mg4005 -o my_motor.toml --report my_motor.html
  lk-emu identify may.log --motor mg4005 --expect my_motor.toml

Needs Python 3.11 or newer with numpy and scipy, and matplotlib for --report:
apt install python3-numpy python3-scipy python3-matplotlib.

Exit status: 0 done, 1 something is not as --expect has it, 2 unusable input.)";

/// The options of python/lkemu/identify, for the help, the completions and their check.
struct IdentifyApp {
  CLI::App app{"Find a motor's numbers in logs of it, and write a motor file", "lk-emu identify"};
  std::vector<std::string> logs;
  std::string given;
  int id = 0;

  IdentifyApp() {
    app.footer(kIdentifyFooter);
    app.add_option("LOG", logs,
                   "what candump -L logged of the motor at work, or the script of --plan");
    app.add_option(
           "--motor", given,
           std::string("what is known of the motor, a name or a file: gear, encoder, torque "
                       "constant (default ") +
               kDefaultMotor + ")")
        ->type_name("MOTOR");
    app.add_option("--generation", given,
                   "firmware of the drives, one of " + comma_list(generation_words()) +
                       " (default: as the log shows)")
        ->type_name("GENERATION");
    app.add_option("--id", id, "this drive alone (default: all that the log has)")
        ->type_name("ID")
        ->check(CLI::Range(1, kMaxId));
    app.add_option("-o,--output", given, "motor file to write")->type_name("FILE");
    app.add_option("--report", given, "page with pictures to write, one HTML file")
        ->type_name("FILE");
    app.add_option("--expect", given, "motor file of an earlier time; says what has changed")
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

}  // namespace lk::emulator
