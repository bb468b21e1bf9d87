#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/core/text.hpp"
#include "emulator/files/profile_files.hpp"
#include "tools/commands/cli.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/language_option.hpp"
#include "tools/ctl/ctl_client.hpp"
#include "tools/ctl/ctl_tables.hpp"
#include "tools/ctl/ctl_watch.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kExitStatus =
    "\nExit status: 0 done, 1 refused, or the answer could not be printed, 2 unusable input or "
    "no answer.";

struct RawCtl {
  std::string socket;
  std::string bus;
  bool json = false;
  std::string word;
  std::vector<std::string> words;
  std::string ids;
  std::string at;
  std::string lasts;
  std::string language;
};

using Answer = CtlClient::Answer;

/// Makes all strings safe to print, because they may come from other programs.
Json printable(Json json) {
  if (json.is_string()) return sanitized_line(json.get<std::string>());
  if (json.is_structured()) {
    for (Json& part : json) part = printable(part);
  }
  return json;
}

class Ctl {
 public:
  explicit Ctl(const RawCtl& raw) : raw_(raw) {}

  int status() { return show(client().ask("GET", "/status"), status_table); }
  int drives() { return show(client().ask("GET", "/drives"), drives_table); }
  int faults() { return show(client().ask("GET", "/faults"), faults_table); }
  int advice() {
    const bool chinese = chosen_language(raw_.language) == Language::kChinese;
    return show(client().ask("GET", "/advice"), chinese ? advice_table_zh : advice_table_en);
  }
  int drive() {
    const int id = drive_id();
    return show(client().ask("GET", drive_path(id)), drive_page);
  }
  int watch() { return watch_drives(client()); }

  int set() {
    Json request = Json::object();
    for (const std::string& word : raw_.words) put_word(request, word);
    put_ids(request);
    return direct(std::move(request));
  }

  int fault() {
    Json request = Json::object();
    Json fault = {{"kind", raw_.word}};  // inserted last: insertions move elements of `request`
    for (const std::string& word : raw_.words) {
      const bool of_event = word.starts_with("id=") || word.starts_with("ids=") ||
                            word.starts_with("at_s=") || word.starts_with("when.");
      put_word(of_event ? request : fault, word);
    }
    put_ids(request);
    if (!raw_.at.empty()) request["at_s"] = parse_span_s(raw_.at);
    if (!raw_.lasts.empty()) fault["for_s"] = parse_span_s(raw_.lasts);
    request["fault"] = std::move(fault);
    return direct(std::move(request));
  }

  int send() {
    Json request = Json::object();
    for (const std::string& word : raw_.words) put_word(request, word);
    put_ids(request);
    request[raw_.word.find('#') != std::string::npos ? "frame" : "command"] = raw_.word;
    if (!raw_.bus.empty() && !request.contains("bus")) request["bus"] = raw_.bus;
    return show(client().ask("POST", "/frames", request), sent_lines);
  }

  /// Waits until all interfaces are up. Asks the program itself, because a log may be old.
  int wait() {
    const double limit_s = raw_.lasts.empty() ? 30 : parse_span_s(raw_.lasts);
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(limit_s);
    for (;;) {
      const std::string problem = not_ready();
      if (problem.empty()) return 0;
      if (std::chrono::steady_clock::now() >= end) throw StartError(problem);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  int clear() { return direct({{"clear", raw_.word}}); }
  int mark() { return direct({{"mark", raw_.word}}); }

  int power() {
    Json request = {{"power", raw_.word}};
    put_ids(request);
    return direct(std::move(request));
  }

  int clock() {
    return show(raw_.word.empty() ? client().ask("GET", "/clock")
                                  : client().ask("PUT", "/clock", {{"mode", raw_.word}}),
                clock_line);
  }

  int advance() {
    const double by_s = parse_span_s(raw_.word);
    return show(client().ask("POST", "/clock/advance", {{"by_s", by_s}}), time_line);
  }

  int record() {
    if (raw_.word == "stop") return show(client().ask("DELETE", "/recording"), recorded_line);
    return show(client().ask("POST", "/recording", {{"directory", absolute(raw_.word)}}),
                recording_line);
  }

  int scenario() {
    if (raw_.word == "stop") return show(client().ask("DELETE", "/scenario"), scenario_page);
    if (raw_.word == "verdict") return show(client().ask("GET", "/scenario"), scenario_page);
    const std::string file = scenario_file(raw_.word);  // before looking for the program
    return show(client().ask("POST", "/scenario", {{"file", file}}), scenario_page);
  }

 private:
  /// Returns why the program is not ready; empty if it is.
  std::string not_ready() {
    try {
      client_.emplace(find_socket(raw_.socket, raw_.bus));
      const Json status = client_->ask("GET", "/status", nullptr, std::chrono::seconds(2)).body;
      for (const Json& bus : status.value("buses", Json::array())) {
        if (!bus.value("up", false)) return "ctl: " + bus.value("bus", "") + " is not up";
      }
      return "";
    } catch (const StartError& problem) {
      return problem.what();
    }
  }
  /// Looks for the socket at the first request, so that wrong arguments are reported first.
  const CtlClient& client() {
    if (!client_) client_.emplace(find_socket(raw_.socket, raw_.bus));
    return *client_;
  }
  /// Makes a path absolute: the running lk-emu may have another working directory.
  static std::string absolute(const std::string& path) {
    return std::filesystem::absolute(path).lexically_normal().string();
  }
  static std::string scenario_file(const std::string& given) {
    try {
      return absolute(meant_file(kScenarios, given).string());
    } catch (const std::invalid_argument& problem) {
      throw StartError(std::string("ctl: ") + problem.what());
    }
  }
  static std::string time_line(const Json& json) {
    return std::to_string(json.value("time_s", 0.0)) + " s\n";
  }
  static std::string clock_line(const Json& json) {
    return json.value("mode", std::string()) + ", " + time_line(json);
  }
  static std::string sent_lines(const Json& json) {
    std::string text = "at " + time_line(json);
    for (const Json& frame : json.value("frames", Json::array())) {
      text += frame.get<std::string>() + "\n";
    }
    return text;
  }
  static std::string done_line(const Json& json) {
    std::string text = "at " + time_line(json);
    for (const Json& name : json.value("faults", Json::array())) {
      text += "fault " + name.get<std::string>() + "\n";
    }
    return text;
  }

  int drive_id() const {
    try {
      const std::vector<int> ids = parse_ids(raw_.word);
      if (ids.size() == 1) return ids.front();
    } catch (const std::invalid_argument& problem) {
      throw StartError(std::string("ctl: drive: ") + problem.what());
    }
    throw StartError("ctl: drive: one ID, not several");
  }

  std::string drive_path(int id) {
    std::string bus = raw_.bus;
    if (bus.empty()) {
      const Json status = client().ask("GET", "/status").body;
      if (status["buses"].size() > 1)
        throw StartError("ctl: there are several buses; choose one with --bus");
      bus = status["buses"][0].value("bus", "");
    }
    return "/drives/" + bus + "/" + std::to_string(id);
  }

  void put_ids(Json& request) const {
    if (raw_.ids.empty()) return;
    if (request.contains("id") || request.contains("ids"))
      throw StartError("ctl: IDs are given twice");
    request["ids"] = raw_.ids;
  }

  int direct(Json request) {
    if (!raw_.bus.empty() && !request.contains("bus")) request["bus"] = raw_.bus;
    return show(client().ask("POST", "/directives", request), done_line);
  }

  int show(const Answer& answer, std::string (*table)(const Json&)) const {
    if (answer.status >= 300) {
      const Json error = answer.body.value("error", Json::object());
      const std::string where = error.value("where", std::string("?"));
      // Errors in the request path are reported as "ctl", because the user did not type the path.
      std::fprintf(stderr, "lk-emu: %s: %s\n",
                   where == "path" ? "ctl" : sanitized_line(where).c_str(),
                   sanitized_line(error.value("reason", std::string("refused"))).c_str());
      return 1;
    }
    std::fputs((raw_.json ? answer.body.dump(2) + "\n" : table(printable(answer.body))).c_str(),
               stdout);
    return 0;
  }

  const RawCtl& raw_;
  std::optional<CtlClient> client_;
};

/// A subcommand, and the member that runs it.
struct Row {
  const char* word;
  const char* about;
  int (Ctl::*run)();
  const char* argument = nullptr;  // name of the word that follows
  const char* argument_about = "";
  bool needed = true;
  const char* example = nullptr;
};
constexpr Row kRows[] = {
    {"status", "buses, clock, counters", &Ctl::status},
    {"drives", "all drives", &Ctl::drives},
    {"drive", "everything about one drive", &Ctl::drive, "ID", "the drive's, 1 to 32"},
    {"watch", "all drives, live; q leaves", &Ctl::watch},
    {.word = "set",
     .about = "change supply, load or settings of drives (docs/reference/events.md)",
     .run = &Ctl::set,
     .example = "  lk-emu ctl set supply_V=18 ramp_s=0.5 --ids 1-2\n"
                "  lk-emu ctl set load.tau_gravity_Nm=2 --ids 1\n"},
    {"fault", "inject a fault (lk-emu faults lists them)", &Ctl::fault, "FAULT", "its kind", true,
     "  lk-emu ctl fault drop probability=0.1 --ids 1-2 --for 2s\n"},
    {"faults", "the faults so far, and their effects", &Ctl::faults},
    {"advice", "mistakes of the hosts, and their remedies", &Ctl::advice},
    {"send", "send commands or frames to drives, as a host does", &Ctl::send, "COMMAND",
     "a command name of scenarios, a command byte, or a frame: 141#9C00000000000000", true,
     "  lk-emu ctl send position_2 angle_deg=90 --ids 1-4\n"},
    {.word = "wait",
     .about = "wait until lk-emu is ready",
     .run = &Ctl::wait,
     .example = "  lk-emu --bus vcan0 --ids 1 & lk-emu ctl wait --for 10s\n"},
    {"clear", "end a fault, all of a kind, or all", &Ctl::clear, "NAME|all",
     "name or kind of a fault"},
    {"power", "switch the supply", &Ctl::power, "on|off|cycle", "cycle: off, and on again"},
    {"clock", "show or set the clock mode", &Ctl::clock, "MODE",
     "to set: realtime, stepped, or a factor like x10", false},
    {"advance", "advance a stepped clock", &Ctl::advance, "TIME", "10ms, 1.5s, 2min", true,
     "  lk-emu ctl clock stepped && lk-emu ctl advance 10ms\n"},
    {"record", "record into a directory, or stop", &Ctl::record, "DIR|stop",
     "new or empty, for lk-emu replay"},
    {"scenario", "run a scenario, stop it, or show its verdict", &Ctl::scenario,
     "SCENARIO|stop|verdict",
     "scenario file or name, as for lk-emu run (docs/guides/scenarios.md)"},
    {"mark", "write a note into log and recording", &Ctl::mark, "TEXT", "the note"},
};

void add_arguments(CLI::App& sub, const Row& row, RawCtl& raw) {
  const std::string_view word = row.word;
  if (row.argument != nullptr) {
    sub.add_option(row.argument, raw.word, row.argument_about)->required(row.needed);
  }
  if (word == "set") {
    sub.add_option("ASSIGNMENT", raw.words, "what to change: KEY=VALUE")->required();
  }
  if (word == "fault") sub.add_option("ASSIGNMENT", raw.words, "its parameters: KEY=VALUE");
  if (word == "send") sub.add_option("ASSIGNMENT", raw.words, "its quantities: KEY=VALUE");
  if (word == "wait") {
    sub.add_option("--for", raw.lasts, "time-out (default 30s)")->type_name("TIME");
  }
  if (word == "set" || word == "fault" || word == "power" || word == "send") {
    sub.add_option("--ids", raw.ids, "drives, e.g. 1-2 (default all)")->type_name("LIST");
  }
  if (word == "fault") {
    sub.add_option("--at", raw.at, "simulated time at which it begins: 1.5s (default now)")
        ->type_name("TIME");
    sub.add_option("--for", raw.lasts, "how long it lasts: 500ms, 2s, 1min")->type_name("TIME");
  }
}

struct CtlApp {
  CLI::App app{"Inspect and control a running lk-emu", "lk-emu ctl"};
  RawCtl raw;
  std::vector<CLI::App*> subs;  // one for each row

  CtlApp() {
    app.require_subcommand(1);
    app.fallthrough();
    app.add_option("--socket", raw.socket, "its control socket (default: the only one)")
        ->type_name("PATH");
    app.add_option("--bus", raw.bus, "the bus, when there are several")->type_name("BUS");
    app.add_flag("--json", raw.json, "print the answer as JSON");
    add_language_option(app, raw.language);
    std::string examples;
    for (const Row& row : kRows) {
      subs.push_back(app.add_subcommand(row.word, row.about));
      add_arguments(*subs.back(), row, raw);
      std::string notes = "\nTakes --socket, --bus, --json and --lang of lk-emu ctl too.\n";
      if (row.example != nullptr) notes += std::string("\nExample:\n") + row.example;
      subs.back()->footer(notes + kExitStatus);
      if (row.example != nullptr) examples += row.example;
    }
    app.footer("\nExamples:\n" + examples + kExitStatus);
  }
};

}  // namespace

std::shared_ptr<CLI::App> ctl_app() {
  const auto made = std::make_shared<CtlApp>();
  return {made, &made->app};
}

int run_ctl(int argc, const char* const* argv) {
  CtlApp given;
  if (!parse_arguments(given.app, argc, argv)) return 0;
  Ctl ctl(given.raw);
  for (std::size_t n = 0; n < given.subs.size(); ++n) {
    if (given.subs[n]->parsed()) return (ctl.*kRows[n].run)();
  }
  return 2;
}

}  // namespace lk::emulator
