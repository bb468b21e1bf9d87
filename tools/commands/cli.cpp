#include "tools/commands/cli.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <variant>

#include "emulator/config/bus_name.hpp"
#include "emulator/config/config_quirks.hpp"
#include "emulator/config/config_serial.hpp"
#include "emulator/config/ip_address.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/core/text.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/files/profile_files.hpp"
#include "emulator/io/program/answered_ids.hpp"
#include "emulator/monitor/record/recording.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/commands.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kFooter = R"(
--ids, --generation and --quirk belong to the --bus before them; --generation and --quirk before
any --bus are for all. Example, two buses:
  lk-emu --bus vcan0 --ids 1-4 --bus vcan1 --ids 1,3,7-9 --generation v236

Exit status: 0 stopped by SIGINT or SIGTERM, 1 failed while running (with --strict: or advice
was given), 2 unusable input; with --scenario its verdict: 0 passed, 1 failed, 3 invalid.)";

/// Values of the options, as CLI11 stores them. The first four options are repeatable.
struct Raw {
  std::vector<std::string> buses;
  std::vector<std::string> ids;
  std::vector<std::string> generations;
  std::vector<std::string> quirks;
  std::string motor;
  std::string config;
  std::string seed;
  std::string bitrate;
  std::string baud;
  std::string boot_angle;
  std::string rom;
  std::string clock = "realtime";
  std::string control;
  std::string scenario;
  std::string junit;
  std::string http;
  std::string http_token;
  std::string shafts;
  std::string shafts_lost = "free";
  bool http_write = false;
  std::string record;
  std::string language;
  CommandLine line;
};

void add_options(CLI::App& app, Raw& raw) {
  app.add_option("--bus", raw.buses,
                 "bus to answer on, like " + bus_examples() +
                     " (repeatable; docs/guides/buses.md says which hosts can use which, and how)")
      ->type_name("BUS")
      ->allow_extra_args(false);
  app.add_option("--ids", raw.ids, "IDs of the drives on that bus, 1..32: 1-4 or 1,3,7-9")
      ->type_name("LIST")
      ->allow_extra_args(false);
  app.add_option(
         "--motor", raw.motor,
         std::string(
             "motor of every drive: its product name, or a motor file like ./my.toml (default ") +
             kDefaultMotor + ")")
      ->type_name("MOTOR");
  app.add_option("--generation", raw.generations,
                 "firmware of the drives, one of " + comma_list(generation_words()) +
                     " (default legacy); seen: as measured on real drives of their motor")
      ->type_name("NAME")
      ->allow_extra_args(false);
  app.add_option("--quirk", raw.quirks,
                 "one switch of the firmware, e.g. pid_commands=true (repeatable; "
                 "docs/reference/configuration.md has them all)")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  app.add_option("--config", raw.config,
                 "TOML file with buses, drives and settings, or the name of a shipped one")
      ->type_name("ROBOT");
  app.add_option("--seed", raw.seed, "seed of noise and boot angles (default 1)")->type_name("N");
  app.add_option("--bitrate", raw.bitrate,
                 "modelled bit rate in bit/s, 0 = frames take no time (default 1000000)")
      ->type_name("N");
  app.add_option("--baud", raw.baud,
                 "bit rate of RS-485 in bit/s, 0 = bytes take no time (default 115200)")
      ->type_name("N");
  app.add_option(
         "--boot-angle", raw.boot_angle,
         "rotor angle of every drive at the start, in degrees (default: random, from the seed)")
      ->type_name("DEG");
  app.add_option("--rom", raw.rom,
                 "directory for the ROM of the drives, or :memory: to keep nothing (default "
                 "lk-emu/BUS in the user's state directory)")
      ->type_name("DIR");
  app.add_flag("--wipe-rom", raw.line.run.rom.wipe,
               "remove the ROM files of these drives first: they start as configured");
  app.add_option("--record", raw.record, "directory to record into, for lk-emu replay")
      ->type_name("DIR");
  app.add_flag("--create-bus", raw.line.run.create_buses,
               "create missing interfaces as vcan and bring them up (needs CAP_NET_ADMIN)");
  app.add_flag("--real-bus", raw.line.run.real_bus,
               "allow interfaces that are not virtual (vcan, vxcan); no real drive on them may "
               "have one of the IDs");
  app.add_flag("--check", raw.line.check,
               "check and print the configuration, and exit; needs no CAN interface");
  app.add_option("--clock", raw.clock,
                 "clock: realtime (default), a factor like x10 or x0.1, or stepped: advances only "
                 "with lk-emu ctl advance")
      ->type_name("MODE");
  app.add_option("--scenario", raw.scenario,
                 "run this scenario (a file, or the name of a shipped one) on the buses, print its "
                 "verdict and exit (docs/guides/scenarios.md)")
      ->type_name("SCENARIO");
  app.add_option("--junit", raw.junit, "write the scenario's verdict as JUnit XML")
      ->type_name("FILE");
  app.add_flag(
      "--strict", raw.line.run.strict,
      "exit with status 1 if there is advice about the host (docs/guides/host-mistakes.md)");
  add_language_option(app, raw.language);
  app.add_option("--control", raw.control,
                 "Unix socket of the control interface, or none (default lk-emu/BUS-PID.sock in "
                 "XDG_RUNTIME_DIR)")
      ->type_name("PATH");
  app.add_option("--http", raw.http,
                 "control interface and dashboard over TCP, e.g. at localhost:8474 (port 0: any)")
      ->type_name("ADDR:PORT");
  app.add_flag("--http-write", raw.http_write,
               "let the dashboard make changes, and with --http-token none all clients (default: "
               "read-only)");
  app.add_option("--http-token", raw.http_token,
                 "file with the token that clients must send, or none; required if other machines "
                 "can reach the address")
      ->type_name("FILE");
  app.add_option("--shafts", raw.shafts,
                 "address at which an external simulator connects to the drives' shafts, as "
                 "unix:/tmp/shafts or tcp:29600 (docs/guides/your-simulator.md)")
      ->type_name("PLACE");
  app.add_option("--shafts-lost", raw.shafts_lost,
                 "while no simulator is connected: free = the drives keep running (default), stop "
                 "= time is stopped")
      ->type_name("WHAT");
  app.add_flag("--end-with-stdin", raw.line.run.end_with_input,
               "stop when standard input ends (a pipe from the parent process)");
  app.add_option("--log-level", raw.line.log_level,
                 "trace, debug, info, warn, error or off (default info)")
      ->type_name("LEVEL");
}

struct ProgramApp {
  CLI::App app{"Virtual LK-TECH servo drives on a real CAN bus", "lk-emu"};
  Raw raw;

  ProgramApp() {
    app.set_version_flag("--version", "lk-emu " LKEMU_VERSION);
    add_options(app, raw);
    // The other commands have their own --help.
    std::string others = "\nOther commands, see lk-emu WORD --help:\n";
    for (const Command& command : commands()) {
      others += fmt::format("  {:<8}  {}\n", command.word, command.about);
    }
    app.footer(others + kFooter);
  }
};

void add_bus(const std::string& interface, std::vector<BusRequest>& requests) {
  const std::string problem = interface_name_problem(interface);
  if (!problem.empty()) throw StartError("--bus: " + problem);
  for (const auto& request : requests) {
    if (request.interface == interface) throw StartError("--bus: " + interface + " is given twice");
  }
  requests.push_back({interface, std::nullopt});
}

void set_ids(const std::string& list, std::vector<BusRequest>& requests) {
  if (requests.empty()) throw StartError("--ids " + list + " has no --bus before it");
  if (requests.back().ids) {
    throw StartError("--bus " + requests.back().interface +
                     " has two --ids; write one list: 1,3,7-9");
  }
  try {
    requests.back().ids = parse_ids(list);
  } catch (const std::invalid_argument& problem) {
    throw StartError(std::string("--ids: ") + problem.what());
  }
}

void set_generation(const std::string& word, FirmwareRequest& firmware) {
  if (firmware.generation) throw StartError("--generation is given twice for the same drives");
  firmware.generation = word;
}

void set_quirk(const std::string& text, FirmwareRequest& firmware) {
  const std::size_t equals = text.find('=');
  const std::string key =
      small_letters(std::string(trimmed(std::string_view(text).substr(0, equals))));
  if (equals == std::string::npos || key.empty()) {
    throw StartError("--quirk: \"" + text + "\" is not NAME=VALUE, like pid_commands=true");
  }
  if (!firmware.quirks.emplace(key, trimmed(std::string_view(text).substr(equals + 1))).second) {
    throw StartError("--quirk: " + key + " is given twice for the same drives");
  }
}

/// Assigns each option that is for one bus to the --bus before the option.
void pair_up(const CLI::App& app, const Raw& raw, Overrides& overrides) {
  auto next_bus = raw.buses.begin();
  auto next_ids = raw.ids.begin();
  auto next_generation = raw.generations.begin();
  auto next_quirk = raw.quirks.begin();
  std::vector<BusRequest>& requests = overrides.buses;
  for (const CLI::Option* option : app.parse_order()) {
    const std::string name = option->get_name();
    auto& firmware = requests.empty() ? overrides.firmware : requests.back().firmware;
    if (name == "--bus") add_bus(*next_bus++, requests);
    if (name == "--ids") set_ids(*next_ids++, requests);
    if (name == "--generation") set_generation(*next_generation++, firmware);
    if (name == "--quirk") set_quirk(*next_quirk++, firmware);
  }
}

void check_log_level(const std::string& level) {
  if (std::ranges::find(kLogLevels, level) != std::end(kLogLevels)) return;
  throw StartError("--log-level: \"" + level +
                   "\" is not one of trace, debug, info, warn, error, off");
}

/// Parses a decimal number: 010 is ten. Throws StartError if `text` is wrong or out of range.
std::int64_t parse_number(const char* option, const std::string& text) {
  std::int64_t number = 0;
  const char* last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  if (error == std::errc::result_out_of_range) {
    throw StartError(fmt::format("{}: {} is out of range", option, text));
  }
  if (error != std::errc() || end != last) {
    throw StartError(fmt::format("{}: \"{}\" is not a whole number", option, text));
  }
  return number;
}

/// Parses a bit rate. `problem` returns what is wrong with a rate; empty: nothing.
std::int64_t parse_rate(const char* option, const std::string& text,
                        std::string (*problem)(std::int64_t)) {
  const std::int64_t rate = parse_number(option, text);
  const std::string reason = problem(rate);
  if (!reason.empty()) throw StartError(fmt::format("{}: {}", option, reason));
  return rate;
}

double parse_real(const char* option, const std::string& text) {
  double number = 0;
  const char* last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  if (error != std::errc() || end != last || !std::isfinite(number)) {
    throw StartError(fmt::format("{}: \"{}\" is not a number", option, text));
  }
  return number;
}

/// Parses "127.0.0.1:8474", "[::1]:0", "localhost:8474". Looks up no names: localhost is 127.0.0.1,
/// which browsers use if ::1 does not answer.
HttpAddress parse_http_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const std::string host = text.substr(0, colon);
  // IPv6 addresses contain colons, so they need brackets.
  if (colon == std::string::npos || host.empty() ||
      host.starts_with('[') != (host.find(':') != std::string::npos)) {
    throw StartError("--http: \"" + text +
                     "\" is not ADDR:PORT, like 127.0.0.1:8474 or localhost:8474");
  }
  if (colon + 1 == text.size()) {
    throw StartError("--http: " + text + " needs a port, like " + text + "8474");
  }
  const auto address = address_in(host);
  if (!address) {
    throw StartError("--http: \"" + host + "\" is not an IP address or localhost");
  }
  const std::int64_t port = parse_number("--http", text.substr(colon + 1));
  if (port < 0 || port > 65535) {
    throw StartError("--http: port " + std::to_string(port) + " is out of range");
  }
  return {*address, static_cast<std::uint16_t>(port)};
}

/// Throws if other machines could reach the control interface without a token. The start would fail
/// too; this check makes --check fail.
void check_reach(const ControlOptions& control) {
  if (control.http && !is_loopback(control.http->address) && control.token_file.empty() &&
      !control.open_to_others) {
    throw StartError("--http: others can reach " + control.http->address +
                     ": give a --http-token FILE, or none");
  }
}

void read_rom_option(const std::string& text, RomOptions& rom) {
  if (text.empty()) throw StartError("--rom: needs a directory, or :memory:");
  rom.in_memory = text == ":memory:";
  if (!rom.in_memory) rom.directory = text;
  if (rom.in_memory && rom.wipe) {
    throw StartError("--wipe-rom: not possible with --rom :memory:, which keeps nothing");
  }
}

std::optional<ShaftOptions> read_shafts(const CLI::App& app, const Raw& raw) {
  if (app.count("--shafts") == 0) {
    if (app.count("--shafts-lost") > 0) throw StartError("--shafts-lost: belongs to --shafts");
    return std::nullopt;
  }
  auto place = parse_shafts_place(raw.shafts);
  if (const auto* const problem = std::get_if<std::string>(&place)) {
    throw StartError("--shafts: " + *problem);
  }
  auto& shafts = std::get<ShaftOptions>(place);
  const auto lost = parse_shafts_lost(raw.shafts_lost);
  if (!lost)
    throw StartError("--shafts-lost: \"" + raw.shafts_lost + "\" is neither free nor stop");
  shafts.lost = *lost;
  if (app.count("--record") > 0) {
    throw StartError("--record: not possible with --shafts: the simulator is not recorded");
  }
  return shafts;
}

CommandLine gather(const CLI::App& app, Raw& raw) {
  CommandLine& line = raw.line;
  RunOptions& run = line.run;
  pair_up(app, raw, run.overrides);
  if (app.count("--motor") > 0) run.overrides.motor = raw.motor;
  if (app.count("--config") > 0) line.config_file = raw.config;
  if (app.count("--seed") > 0) {
    const std::int64_t seed = parse_number("--seed", raw.seed);
    if (seed < 0) throw StartError("--seed: " + raw.seed + " is negative");
    run.overrides.seed = static_cast<std::uint64_t>(seed);
  }
  if (app.count("--bitrate") > 0) {
    run.overrides.bitrate = parse_rate("--bitrate", raw.bitrate, bitrate_problem);
  }
  if (app.count("--baud") > 0) {
    run.overrides.baud = parse_rate("--baud", raw.baud, baud_problem);
  }
  if (app.count("--boot-angle") > 0) {
    run.overrides.boot_angle_deg = parse_real("--boot-angle", raw.boot_angle);
  }
  if (app.count("--rom") > 0) read_rom_option(raw.rom, run.rom);
  const auto clock = parse_clock_mode(raw.clock);
  if (!clock) {
    throw StartError("--clock: \"" + raw.clock +
                     "\" is not one of realtime, stepped and x0.001 to x1000");
  }
  run.clock = *clock;
  if (app.count("--scenario") > 0) line.scenario = raw.scenario;
  if (app.count("--junit") > 0) {
    if (!line.scenario) throw StartError("--junit: belongs to --scenario");
    run.junit = raw.junit;
  }
  if (app.count("--control") > 0) run.control.socket = raw.control;
  if (app.count("--http") > 0) run.control.http = parse_http_address(raw.http);
  if (app.count("--http-token") > 0) {
    if (!run.control.http) throw StartError("--http-token: belongs to --http");
    run.control.open_to_others = raw.http_token == "none";
    if (!run.control.open_to_others) run.control.token_file = raw.http_token;
  }
  check_reach(run.control);
  if (raw.http_write && !run.control.http) throw StartError("--http-write: belongs to --http");
  run.control.pages_may_write = raw.http_write;
  run.control.page_language = raw.language;
  run.shafts = read_shafts(app, raw);
  if (app.count("--record") > 0) {
    if (raw.record.empty()) throw StartError("--record: needs a directory");
    run.record = raw.record;
  }
  run.language = chosen_language(raw.language);
  check_log_level(line.log_level);
  return line;
}

}  // namespace

std::optional<CommandLine> parse_command_line(int argc, const char* const* argv) {
  ProgramApp given;
  std::vector<std::string> words;
  for (const Command& command : commands()) words.emplace_back(command.word);
  if (!parse_arguments(given.app, argc, argv, words)) return std::nullopt;
  return gather(given.app, given.raw);
}

std::shared_ptr<CLI::App> program_app() {
  const auto made = std::make_shared<ProgramApp>();
  return {made, &made->app};
}

std::vector<BusConfig> load_config(CommandLine& command_line) {
  const Overrides& overrides = command_line.run.overrides;
  ConfigTexts& read = command_line.run.texts;
  const FindProfile find_profile = profile_finder(read.motors);
  try {
    if (!command_line.config_file && overrides.buses.empty() && !command_line.check) {
      throw StartError(bus_offer());
    }
    if (!command_line.config_file) return default_config(overrides, find_profile);
    read.config_file = meant_file(kRobots, command_line.config_file->string()).string();
    read.config = read_regular_file(read.config_file, kLongestText);
    return parse_config(*read.config, read.config_file, overrides, find_profile, body_loader());
  } catch (const ConfigError& problem) {
    throw StartError(problem.what());
  } catch (const UnknownMotor& problem) {
    throw StartError(std::string("--motor: ") + problem.what());
  } catch (const std::invalid_argument& problem) {
    throw StartError(problem.what());
  }
}

}  // namespace lk::emulator
