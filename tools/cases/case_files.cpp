#include "tools/cases/case_files.hpp"

#include <utility>

#include "emulator/files/output_file.hpp"
#include "emulator/files/profile_files.hpp"

namespace lk::emulator {
namespace {

constexpr std::size_t kMaxRobots = 64;  // a campaign may vary the bit rate of every case

}  // namespace

std::uint64_t text_hash(std::string_view text, std::uint64_t so_far) {
  for (const char c : text) {
    so_far = (so_far ^ static_cast<std::uint8_t>(c)) * 0x100000001B3U;
  }
  return so_far;
}

ScenarioFiles CaseFiles::files() {
  return {.robot = [this](const std::string& name,
                          const Overrides& overrides) { return robot(name, overrides); },
          .text = [this](const std::string& name) { return text(directory_ / name, kLongestLog); }};
}

const std::string& CaseFiles::text(const std::filesystem::path& file, std::uintmax_t longest) {
  const auto known = texts_.find(file);
  if (known != texts_.end()) return known->second;
  return texts_.emplace(file, read_regular_file(file, longest)).first->second;
}

std::vector<BusConfig> CaseFiles::robot(const std::string& name, const Overrides& overrides) {
  const RobotKey key{name, overrides.firmware.generation.value_or(""),
                     overrides.bitrate.value_or(-1)};
  auto known = robots_.find(key);
  if (known == robots_.end()) {
    if (robots_.size() >= kMaxRobots) robots_.clear();
    const std::filesystem::path file =
        is_path(name) ? directory_ / name : shipped_file(kRobots, name);
    Overrides without_seed = overrides;
    without_seed.seed.reset();
    LoadBody load = body_loader();
    if (load) {
      load = [this, make = load](const std::string& robot_file, const std::string& model,
                                 SimTime step) {
        text(body_file(robot_file, model), kLongestLog);  // reads the file for hash()
        return make(robot_file, model, step);
      };
    }
    known = robots_
                .emplace(key, parse_config(text(file, kLongestText), file.string(), without_seed,
                                           profile_finder(motors_), load))
                .first;
  }
  std::vector<BusConfig> robot = known->second;
  for (std::size_t n = 0; overrides.seed && n < robot.size(); ++n) {
    robot[n].seed = bus_seed(*overrides.seed, n);
  }
  return robot;
}

std::uint64_t CaseFiles::hash() const {
  std::uint64_t sum = 0;
  for (const auto& [file, text] : texts_) sum += text_hash(text);
  for (const auto& [name, motor] : motors_) sum += text_hash(motor.text);
  return sum;
}

}  // namespace lk::emulator
