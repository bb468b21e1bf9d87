#include "emulator/scenario/scenario_files.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "emulator/files/body_files.hpp"
#include "emulator/files/profile_files.hpp"
#include "emulator/files/regular_file.hpp"
#include "emulator/ground/start_error.hpp"
#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

fs::path robot_file(const std::string& name, const fs::path& directory) {
  return is_path(name) ? directory / name : shipped_file(kRobots, name);
}

/// Returns "; its drive 1 on vcan0 is mg8016, here it is mf7015 (and 2 more)", or "".
std::string foreign_text(const Scenario& scenario) {
  if (scenario.foreign.empty()) return "";
  const ForeignDrive& first = scenario.foreign.front();
  const std::string here =
      first.running.empty() ? "there is none here" : "here it is " + on_one_line(first.running);
  const std::size_t more = scenario.foreign.size() - 1;
  return "; its drive " + std::to_string(first.id) + " on " + on_one_line(first.bus) + " is " +
         on_one_line(first.meant) + ", " + here +
         (more > 0 ? " (and " + std::to_string(more) + " more)" : "");
}

template <class Parse>
Scenario load(Parse parse) {
  try {
    return parse();
  } catch (const ConfigError& problem) {
    throw StartError(problem.what());
  } catch (const std::invalid_argument& problem) {
    throw StartError(problem.what());
  }
}

}  // namespace

ScenarioFiles scenario_files(const fs::path& directory, FileLimits limits) {
  return {
      .robot =
          [directory, limits](const std::string& name, const Overrides& overrides) {
            const fs::path file = robot_file(name, directory);
            MotorFiles motors;
            return parse_config(read_regular_file(file, std::min(limits.each, kLongestText)),
                                file.string(), overrides, profile_finder(motors), body_loader());
          },
      .text =
          [directory, limits, played = std::uintmax_t{0}](const std::string& name) mutable {
            if (limits.no_logs) {
              throw std::invalid_argument("logs are played for clients of the Unix socket alone");
            }
            std::string text = read_regular_file(directory / name, limits.each);
            played += text.size();
            if (played <= limits.played) return text;
            throw std::invalid_argument("what is played is longer than " +
                                        std::to_string(limits.played) + " bytes in all");
          },
  };
}

Scenario load_scenario(const std::string& given, std::optional<std::uint64_t> seed) {
  return load([&] {
    const fs::path file = meant_file(kScenarios, given);
    return parse_scenario(read_regular_file(file, kLongestText), file.string(), seed,
                          scenario_files(file.parent_path()));
  });
}

Scenario load_live_scenario(const std::string& given, const std::vector<BusConfig>& running,
                            FileLimits limits) {
  Scenario scenario = load([&] {
    const fs::path file = meant_file(kScenarios, given);
    return parse_live_scenario(read_regular_file(file, limits.each), file.string(), running,
                               scenario_files(file.parent_path(), limits));
  });
  if (!scenario.robot_name.empty()) {
    spdlog::info("scenario {}: its robot {} is not used, the drives are those that run{}",
                 on_one_line(scenario.name), on_one_line(scenario.robot_name),
                 foreign_text(scenario));
  }
  return scenario;
}

}  // namespace lk::emulator
