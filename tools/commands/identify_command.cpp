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

void write_file(const std::string& path, const char* option, const std::string& text) {
  OutputFile file(path, option);
  file.write(text);
  file.commit();
}

int write_plan(const IdentifyApp& given, const Profile& base) {
  if (!given.logs.empty()) throw StartError("identify: a log or --plan, not both");
  if (given.id == 0) throw StartError("identify: --plan needs --id, the drive that it moves");
  ServoConfig servo;
  try {
    servo = read_as(given.id, {}, {base, optional_text(given.generation), {}});
  } catch (const std::invalid_argument& problem) {
    throw StartError(std::string("--generation: ") + problem.what());
  }
  const PlanLimits limits = plan_limits(base);
  write_file(given.plan, "--plan", plan_script(servo, limits));
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

int read_logs(const IdentifyApp& given, const Profile& base) {
  std::vector<IdentifiedDrive> drives;
  for (Track& track : tracks_of(given, base)) drives.push_back(identify(std::move(track)));
  if (drives.empty()) {
    throw StartError(
        fmt::format("identify: no drive{} has told enough of its shaft: {} replies to 0x9C or to "
                    "motion commands "
                    "are needed",
                    given.id != 0 ? fmt::format(" {}", given.id) : "", kFewestSamples));
  }
  if (drives.size() > 1 && (!given.output.empty() || !given.expect.empty())) {
    throw StartError(
        fmt::format("identify: the log has {} drives; say which with --id", drives.size()));
  }
  for (const IdentifiedDrive& drive : drives) {
    std::fputs(identified_table_text(drive).c_str(), stdout);
  }
  if (!given.output.empty()) {
    write_file(given.output, "--output",
               motor_text(drives.front(), base_for_file(given.motor), given.logs));
  }
  if (!given.report.empty()) {
    write_file(given.report, "--report", identified_report(drives, given.logs));
  }
  if (given.expect.empty()) return 0;
  const auto expected =
      expected_values(read_regular_file(given.expect, kLongestText), given.expect);
  const auto changed = changes(drives.front(), expected, given.expect);
  for (const std::string& line : changed) std::printf("%s\n", line.c_str());
  if (changed.empty()) std::printf("as %s has it\n", given.expect.c_str());
  return changed.empty() ? 0 : 1;
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
  }
}

}  // namespace lk::emulator
