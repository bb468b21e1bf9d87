#include "emulator/scenario/scenario_files.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/program/cli.hpp"
#include "emulator/program/profile_files.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> known_robots() {
  std::vector<std::string> names;
  std::error_code none_there;
  for (const auto& entry : fs::directory_iterator(config_directory() / "buses", none_there)) {
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  return names;
}

fs::path robot_file(const std::string& name, const fs::path& directory) {
  const bool is_path = name.find('/') != std::string::npos || name.ends_with(".toml");
  if (is_path) return directory / name;
  const std::vector<std::string> known = known_robots();
  if (std::ranges::find(known, name) == known.end()) {
    std::string all;
    for (const std::string& robot : known) all += (all.empty() ? "" : ", ") + robot;
    const std::string meant = nearest(name, known);
    throw std::invalid_argument("no robot \"" + name + "\"" +
                                (meant.empty() ? "" : ", did you mean " + meant + "?") +
                                " (there are: " + all + "; or give a path to a .toml file)");
  }
  return config_directory() / "buses" / (name + ".toml");
}

/// A motor file is read once, however many drives use it.
FindProfile cached_profiles() {
  return [known = std::map<std::string, Profile>()](const std::string& name) mutable {
    const auto found = known.find(name);
    return found != known.end() ? found->second
                                : known.emplace(name, load_profile(name)).first->second;
  };
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
            return parse_config(read_regular_file(file, limits.each), file.string(), overrides,
                                cached_profiles());
          },
      .text =
          [directory, limits, played = std::uintmax_t{0}](const std::string& name) mutable {
            std::string text = read_regular_file(directory / name, limits.each);
            played += text.size();
            if (played <= limits.played) return text;
            throw std::invalid_argument("what is played is longer than " +
                                        std::to_string(limits.played) + " bytes in all");
          },
  };
}

Scenario load_scenario(const fs::path& file, std::optional<std::uint64_t> seed) {
  return load([&] {
    return parse_scenario(read_file(file), file.string(), seed, scenario_files(file.parent_path()));
  });
}

Scenario load_live_scenario(const fs::path& file, const std::vector<BusConfig>& running,
                            FileLimits limits) {
  Scenario scenario = load([&] {
    return parse_live_scenario(read_regular_file(file, limits.each), file.string(), running,
                               scenario_files(file.parent_path(), limits));
  });
  if (!scenario.robot_name.empty()) {
    spdlog::info("scenario {}: its robot {} is not used, the drives are those that run",
                 on_one_line(scenario.name), on_one_line(scenario.robot_name));
  }
  return scenario;
}

}  // namespace lk::emulator
