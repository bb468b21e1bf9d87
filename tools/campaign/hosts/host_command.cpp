#include "tools/campaign/hosts/host_command.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <string_view>
#include <utility>

#include "emulator/ground/start_error.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

using Variables = std::vector<std::pair<std::string, std::string>>;

/// This process's, with these; those without a value are left out.
std::vector<std::string> environment_with(const Variables& changes) {
  std::vector<std::string> all;
  for (char** at = ::environ; *at != nullptr; ++at) {
    const std::string_view one(*at);
    const std::string_view name = one.substr(0, one.find('='));
    const bool changed = std::ranges::any_of(
        changes, [&](const auto& change) { return std::string_view(change.first) == name; });
    if (!changed) all.emplace_back(one);
  }
  for (const auto& [name, value] : changes) {
    if (!value.empty()) all.push_back(name + "=" + value);
  }
  return all;
}

std::string filled_in(std::string_view text, const std::map<std::string, std::string>& values) {
  std::string out;
  while (!text.empty()) {
    const std::size_t open = std::min(text.find('{'), text.size());
    out += text.substr(0, open);
    text.remove_prefix(open);
    const std::size_t close = text.find('}');
    const std::string name(close < text.size() ? text.substr(1, close - 1) : "");
    if (const auto found = values.find(name); found != values.end()) {
      out += found->second;
      text.remove_prefix(close + 1);
    } else if (name.starts_with("host.")) {
      throw StartError("host: command: {" + name + "} has no value: it is no dimension");
    } else if (!text.empty()) {
      out += '{';
      text.remove_prefix(1);
    }
  }
  return out;
}

bool can_be_run(const fs::path& file) {
  std::error_code none;
  return fs::is_regular_file(file, none) && ::access(file.c_str(), X_OK) == 0;
}

}  // namespace

std::vector<std::string> filled_in(const HostSetup& setup, const HostCase& one, const HostBus& bus,
                                   const std::string& control) {
  std::map<std::string, std::string> values = {{"bus", bus.name()},
                                               {"channel", bus.channel()},
                                               {"port", bus.port()},
                                               {"control", control},
                                               {"case", std::to_string(one.number)}};
  for (const auto& [name, value] : one.host_values) values["host." + name] = value;
  std::vector<std::string> words;
  for (const std::string& word : setup.command) words.push_back(filled_in(word, values));
  return words;
}

std::string program_of(const HostSetup& setup) {
  if (setup.command.empty() || setup.command.front().empty()) {
    throw StartError("host: command: says no program");
  }
  const std::string& name = setup.command.front();
  if (name.find('/') != std::string::npos) {
    const fs::path file = fs::absolute(setup.directory / name);
    if (can_be_run(file)) return file.string();
    throw StartError("host: command: " + file.string() + " is no program that can be run");
  }
  const char* const path = std::getenv("PATH");
  std::string_view places = path != nullptr ? path : "/usr/local/bin:/usr/bin:/bin";
  while (!places.empty()) {
    const std::size_t end = std::min(places.find(':'), places.size());
    const fs::path file = fs::absolute(fs::path(places.substr(0, end)) / name);
    if (can_be_run(file)) return file.string();
    places.remove_prefix(std::min(end + 1, places.size()));
  }
  throw StartError("host: command: there is no program " + name + " in PATH");
}

Program host_program(const HostSetup& setup, const HostCase& one, const HostBus& bus,
                     const std::string& control) {
  Variables variables = bus.environment();
  variables.emplace_back("LKEMU_CONTROL", control);
  variables.emplace_back("LKEMU_CASE", std::to_string(one.number));
  // Lines come when they are printed, not when there are many.
  variables.emplace_back("PYTHONUNBUFFERED", "1");
  Program program;
  program.path = program_of(setup);
  program.arguments = filled_in(setup, one, bus, control);
  program.environment = environment_with(variables);
  program.directory = setup.directory.string();
  return program;
}

Program emulator_program(const HostSetup& setup, const HostCase& one, const HostBus& bus,
                         const std::string& control) {
  Program program;
  // This very program, whatever has come in its place since it began.
  constexpr const char* kThisProgram = "/proc/self/exe";
  const fs::path name = setup.program.empty() ? fs::read_symlink(kThisProgram) : setup.program;
  program.path = setup.program.empty() ? kThisProgram : name.string();
  std::vector<std::string> words = {name.string(),
                                    "--rom",
                                    ":memory:",
                                    "--control",
                                    control,
                                    "--clock",
                                    setup.stepped ? "stepped" : "realtime",
                                    "--log-level",
                                    "error"};
  if (one.generation) words.insert(words.end(), {"--generation", *one.generation});
  words.insert(words.end(), {"--bus", bus.name()});
  if (bus.own_network()) words.emplace_back("--create-bus");
  const bool has_robot = !one.robot.empty();
  words.insert(words.end(), {has_robot ? "--config" : "--ids", has_robot ? one.robot : "1"});
  if (one.seed) words.insert(words.end(), {"--seed", std::to_string(*one.seed)});
  if (one.bitrate) words.insert(words.end(), {"--bitrate", std::to_string(*one.bitrate)});
  program.arguments = std::move(words);
  program.environment = environment_with({{"NOTIFY_SOCKET", ""}});  // it is no service
  return program;
}

}  // namespace lk::emulator
