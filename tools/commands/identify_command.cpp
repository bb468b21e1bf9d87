#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config_error.hpp"
#include "emulator/config/config_quirks.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/config/profile.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/files/profile_files.hpp"
#include "emulator/files/regular_file.hpp"
#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"
#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"
#include "tools/identify/identified.hpp"
#include "tools/identify/motor_text.hpp"
#include "tools/identify/plan.hpp"
#include "tools/identify/report.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kIdentifyFooter = R"(
Example, at the motor and after it:
  lk-emu identify --plan excite.py --motor mg4005 --id 1
  python3 excite.py --interface socketcan --channel can0 --log my_motor.log
  lk-emu identify my_motor.log --motor mg4005 -o my_motor.toml --report my_motor.html
  lk-emu identify may.log --motor mg4005 --expect my_motor.toml

Exit status: 0 done, 1 something is not as --expect has it, 2 unusable input.)";

struct IdentifyApp {
  CLI::App app{"Find a motor's numbers in logs of it, and write a motor file", "lk-emu identify"};
  std::vector<std::string> logs;
  std::string motor = kDefaultMotor;
  std::string generation;
  int id = 0;
  std::string output;
  std::string report;
  std::string expect;
  std::string plan;

  IdentifyApp() {
    app.footer(kIdentifyFooter);
    app.add_option("LOG", logs,
                   "what candump -L logged of the motor at work, or the script of --plan");
    app.add_option(
           "--motor", motor,
           std::string("what is known of the motor, a name or a file: gear, encoder, torque "
                       "constant (default ") +
               kDefaultMotor + ")")
        ->type_name("MOTOR");
    app.add_option("--generation", generation,
                   "firmware of the drives, one of " + comma_list(generation_words()) +
                       " (default: as the log shows)")
        ->type_name("GENERATION");
    app.add_option("--id", id, "this drive alone (default: all that the log has)")
        ->type_name("ID")
        ->check(CLI::Range(1, kMaxId));
    app.add_option("-o,--output", output, "motor file to write")->type_name("FILE");
    app.add_option("--report", report, "page with pictures to write, one HTML file")
        ->type_name("FILE");
    app.add_option("--expect", expect, "motor file of an earlier time; says what has changed")
        ->type_name("FILE");
    app.add_option("--plan", plan,
                   "write a Python script that moves drive --id for 30 s and logs it, instead of "
                   "reading a log")
        ->type_name("FILE");
  }
};

std::optional<std::string> optional_text(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(text);
}

Profile base_profile(const IdentifyApp& given) {
  try {
    return load_profile(given.motor);
  } catch (const UnknownMotor& problem) {
    throw StartError(std::string("--motor: ") + problem.what());
  } catch (const ConfigError& problem) {
    throw StartError(problem.what());
  } catch (const std::invalid_argument& problem) {
    throw StartError(problem.what());
  }
}

int write_plan(const IdentifyApp& given, const Profile& base) {
  if (!given.logs.empty()) throw StartError("identify: a log or --plan, not both");
  for (const char* option : {"--output", "--report", "--expect"}) {
    if (given.app.count(option) == 0) continue;
    throw StartError(std::string("identify: ") + option + " belongs to a log, not to --plan");
  }
  if (!base.drive.control.has_current_loop) {
    throw StartError("identify: " + on_one_line(given.motor) +
                     " is an MS motor, which reports no current: a plan would tell nothing of it");
  }
  if (given.id == 0) throw StartError("identify: --plan needs --id, the drive that it moves");
  ServoConfig servo;
  try {
    servo = read_as(given.id, {}, {base, optional_text(given.generation), {}});
  } catch (const std::invalid_argument& problem) {
    throw StartError(std::string("--generation: ") + problem.what());
  }
  const PlanLimits limits = plan_limits(base);
  write_output(given.plan, "--plan", plan_script(servo, given.motor, limits));
  std::printf("%s\n",
              fmt::format("{} moves drive {} for 30 s, with up to {:.2f} A and {:.0f} dps of its "
                          "rotor; it asks before it moves.\nIts shaft must be free.",
                          given.plan, given.id, limits.current_A, 2 * limits.speed_dps)
                  .c_str());
  return 0;
}

std::vector<Track> tracks_of(const IdentifyApp& given, const Profile& base) {
  TrackOptions options{base, optional_text(given.generation), {}};
  if (given.id != 0) options.id = given.id;
  std::vector<Track> all;
  for (const std::string& log : given.logs) {
    try {
      for (Track& track : read_tracks(read_regular_file(log, kLongestLog), options)) {
        const auto known = std::ranges::find_if(all, [&track](const Track& one) {
          return one.interface == track.interface && one.id == track.id;
        });
        if (known == all.end()) {
          all.push_back(std::move(track));
        } else {
          append(*known, track);
        }
      }
    } catch (const std::invalid_argument& problem) {
      throw StartError("identify: " + on_one_line(log) + ": " + problem.what());
    }
  }
  return all;
}

/// What stands in `extends`: a name as it is, a path from anywhere.
std::string base_for_file(const std::string& motor) {
  return is_path(motor) ? std::filesystem::absolute(motor).lexically_normal().string() : motor;
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  return !a.empty() && !b.empty() && (a == b || std::filesystem::equivalent(a, b, error));
}

/// Writes a file that will load, or says why the log gives none.
void write_motor(const IdentifyApp& given, const IdentifiedDrive& drive) {
  const std::string text = motor_text(drive, base_for_file(given.motor), given.logs);
  try {
    parse_profile({given.output, given.output, text}, find_motor_file);
  } catch (const ConfigError& problem) {
    throw StartError(std::string("identify: the log gives a motor that cannot be: ") +
                     problem.what());
  }
  write_output(given.output, "--output", text);
}

int compare(const IdentifyApp& given, const IdentifiedDrive& drive,
            const std::vector<ExpectedValue>& expected) {
  const Changes found = changes(drive, expected, on_one_line(given.expect));
  if (found.compared == 0) {
    throw StartError("identify: nothing of " + on_one_line(given.expect) +
                     " is told by this log within 15 %: nothing was compared");
  }
  for (const std::string& line : found.lines) std::printf("%s\n", line.c_str());
  if (found.lines.empty()) {
    std::printf("%d of %zu values compared, as %s has them\n", found.compared, expected.size(),
                on_one_line(given.expect).c_str());
  }
  if (!found.not_compared.empty()) {
    std::printf("%s\n",
                fmt::format("not compared: {}", fmt::join(found.not_compared, ", ")).c_str());
  }
  return found.lines.empty() ? 0 : 1;
}

int read_logs(const IdentifyApp& given, const Profile& base) {
  if (same_file(given.output, given.expect) || same_file(given.output, given.motor)) {
    throw StartError(
        "identify: --output would overwrite the file that it is compared with or made from");
  }
  std::vector<ExpectedValue> expected;
  if (!given.expect.empty()) {
    expected = expected_values(read_regular_file(given.expect, kLongestText), given.expect);
  }
  std::vector<IdentifiedDrive> drives;
  for (Track& track : tracks_of(given, base)) drives.push_back(identify(std::move(track)));
  if (drives.empty()) {
    throw StartError(fmt::format(
        "identify: no drive{} has told enough of its shaft: {} replies to 0x9C or to motion "
        "commands are needed",
        given.id != 0 ? fmt::format(" {}", given.id) : "", kFewestSamples));
  }
  if (drives.size() > 1 && (!given.output.empty() || !given.expect.empty())) {
    throw StartError(
        fmt::format("identify: the log has {} drives; say which with --id", drives.size()));
  }
  for (const IdentifiedDrive& drive : drives) {
    std::fputs(identified_table_text(drive).c_str(), stdout);
  }
  if (!given.report.empty()) {
    write_output(given.report, "--report", identified_report(drives, given.logs));
  }
  if (!given.output.empty()) write_motor(given, drives.front());
  return given.expect.empty() ? 0 : compare(given, drives.front(), expected);
}

}  // namespace

std::shared_ptr<CLI::App> identify_app() {
  const auto made = std::make_shared<IdentifyApp>();
  return {made, &made->app};
}

int run_identify(int argc, const char* const* argv) {
  IdentifyApp given;
  if (!parse_arguments(given.app, argc, argv)) return 0;
  if (given.logs.empty() && given.plan.empty()) {
    throw StartError("identify: needs a log, or --plan FILE for a script that makes one");
  }
  const Profile base = base_profile(given);
  if (!given.plan.empty()) return write_plan(given, base);
  try {
    return read_logs(given, base);
  } catch (const ConfigError& problem) {
    throw StartError(problem.what());
  } catch (const std::invalid_argument& problem) {
    throw StartError(std::string("identify: ") + problem.what());
  }
}

}  // namespace lk::emulator
