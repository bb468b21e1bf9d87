#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "emulator/config/profile.hpp"
#include "emulator/files/profile_files.hpp"
#include "emulator/ground/start_error.hpp"
#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/motor_listing.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kMotorsFooter = R"(
Exit status: 0 done, 1 it could not be printed, 2 unusable input.)";

struct MotorsApp {
  CLI::App app{"List the motor profiles, or show one of them", "lk-emu motors"};
  std::string name;

  MotorsApp() {
    app.footer(kMotorsFooter);
    app.add_option("MOTOR", name, "motor to show with its derived figures: a name or a file");
  }
};

}  // namespace

std::shared_ptr<CLI::App> motors_app() {
  const auto made = std::make_shared<MotorsApp>();
  return {made, &made->app};
}

int run_motors(int argc, const char* const* argv) {
  MotorsApp given;
  if (!parse_arguments(given.app, argc, argv)) return 0;
  try {
    const std::string text =
        given.name.empty() ? list_motors() : describe_motor(load_profile(given.name));
    std::fputs(text.c_str(), stdout);
  } catch (const ConfigError& problem) {
    throw StartError(problem.what());
  } catch (const UnknownMotor& problem) {
    throw StartError(std::string("motors: ") + problem.what());
  }
  return 0;
}

}  // namespace lk::emulator
