#include <CLI/CLI.hpp>
#include <algorithm>
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
#include "tools/commands/arguments.hpp"
#include "tools/commands/commands.hpp"
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

/// Returns `json` with all strings safe to print, because they may come from other programs.
Json printable(Json json) {
  if (json.is_string()) return sanitized_line(json.get<std::string>());
  if (json.is_structured()) {
    for (Json& part : json) part = printable(part);
  }
  return json;
}

/// Returns the absolute path, because the running lk-emu may have another working directory.
std::string absolute(const std::string& path) {
  return std::filesystem::absolute(path).lexically_normal().string();
}

std::string scenario_file(const std::string& given) {
  try {
    return absolute(meant_file(kScenarios, given).string());
  } catch (const std::invalid_argument& problem) {
    throw StartError(std::string("ctl: ") + problem.what());
  }
}

std::string time_line(const Json& json) {
  return std::to_string(json.value("time_s", 0.0)) + " s\n";
}

std::string clock_line(const Json& json) {
  return json.value("mode", std::string()) + ", " + time_line(json);
}

std::string sent_lines(const Json& json) {
  std::string text = "at " + time_line(json);
  for (const Json& frame : json.value("frames", Json::array())) {
    text += frame.get<std::string>() + "\n";
  }
  return text;
}

std::string done_line(const Json& json) {
  std::string text = "at " + time_line(json);
  for (const Json& name : json.value("faults", Json::array())) {
    text += "fault " + name.get<std::string>() + "\n";
  }
  return text;
}

/// A `ctl` command line, and the connection to the running lk-emu.
class Ctl {
 public:
  explicit Ctl(const RawCtl& given) : raw(given) {}

  /// Returns the client. Looks for the socket only now, so that wrong arguments are reported first.
  const CtlClient& client() {
    if (!client_) client_.emplace(find_socket(raw.socket, raw.bus));
    return *client_;
  }

  /// Sends a request and prints its answer. Returns the exit status.
  int ask(const std::string& method, const std::string& path, const Json& body,
          std::string (*table)(const Json&)) {
    const CtlClient::Answer answer = client().ask(method, path, body);
    if (answer.status >= 300) {
      const Json error = answer.body.value("error", Json::object());
      const std::string where = error.value("where", std::string("?"));
      // Errors in the request path are reported as "ctl", because the user did not type the path.
      std::fprintf(stderr, "lk-emu: %s: %s\n",
                   where == "path" ? "ctl" : sanitized_line(where).c_str(),
                   sanitized_line(error.value("reason", std::string("refused"))).c_str());
      return 1;
    }
    std::fputs((raw.json ? answer.body.dump(2) + "\n" : table(printable(answer.body))).c_str(),
               stdout);
    return 0;
  }
  int show(const char* path, std::string (*table)(const Json&)) {
    return ask("GET", path, nullptr, table);
  }
  int direct(Json request) {
    put_bus(request);
    return ask("POST", "/directives", request, done_line);
  }

  void put_bus(Json& request) const {
    if (!raw.bus.empty() && !request.contains("bus")) request["bus"] = raw.bus;
  }
  void put_ids(Json& request) const {
    if (raw.ids.empty()) return;
    if (request.contains("id") || request.contains("ids"))
      throw StartError("ctl: IDs are given twice");
    request["ids"] = raw.ids;
  }
  /// Returns an object with the words KEY=VALUE and the values of --ids.
  Json assignments() const {
    Json request = Json::object();
    for (const std::string& word : raw.words) put_word(request, word);
    put_ids(request);
    return request;
  }

  const RawCtl& raw;

 private:
  std::optional<CtlClient> client_;
};

int drive(Ctl& ctl) {
  std::vector<int> ids;
  try {
    ids = parse_ids(ctl.raw.word);
  } catch (const std::invalid_argument& problem) {
    throw StartError(std::string("ctl: drive: ") + problem.what());
  }
  if (ids.size() != 1) throw StartError("ctl: drive: one ID, not several");
  std::string bus = ctl.raw.bus;
  if (bus.empty()) {
    const Json status = ctl.client().ask("GET", "/status").body;
    if (status["buses"].size() > 1)
      throw StartError("ctl: there are several buses; choose one with --bus");
    bus = status["buses"][0].value("bus", "");
  }
  return ctl.show(("/drives/" + bus + "/" + std::to_string(ids.front())).c_str(), drive_page);
}

int advice(Ctl& ctl) {
  const bool chinese = chosen_language(ctl.raw.language) == Language::kChinese;
  return ctl.show("/advice", chinese ? advice_table_zh : advice_table_en);
}

int fault(Ctl& ctl) {
  Json request = Json::object();
  Json fault = {{"kind", ctl.raw.word}};  // inserted last: insertions move elements of `request`
  for (const std::string& word : ctl.raw.words) {
    const bool of_event = word.starts_with("id=") || word.starts_with("ids=") ||
                          word.starts_with("at_s=") || word.starts_with("when.");
    put_word(of_event ? request : fault, word);
  }
  ctl.put_ids(request);
  if (!ctl.raw.at.empty()) request["at_s"] = parse_span_s(ctl.raw.at);
  if (!ctl.raw.lasts.empty()) fault["for_s"] = parse_span_s(ctl.raw.lasts);
  request["fault"] = std::move(fault);
  return ctl.direct(std::move(request));
}

int send(Ctl& ctl) {
  Json request = ctl.assignments();
  request[ctl.raw.word.find('#') != std::string::npos ? "frame" : "command"] = ctl.raw.word;
  ctl.put_bus(request);
  return ctl.ask("POST", "/frames", request, sent_lines);
}

/// Returns why the running lk-emu is not ready; empty if it is.
std::string not_ready(const RawCtl& raw) {
  try {
    const CtlClient client(find_socket(raw.socket, raw.bus));
    const Json status = client.ask("GET", "/status", nullptr, std::chrono::seconds(2)).body;
    for (const Json& bus : status.value("buses", Json::array())) {
      if (!bus.value("up", false)) return "ctl: " + bus.value("bus", "") + " is not up";
    }
    return "";
  } catch (const StartError& problem) {
    return problem.what();
  }
}

/// Waits until all interfaces are up. Asks the running lk-emu, because its log may be old.
int wait(Ctl& ctl) {
  const double limit_s = ctl.raw.lasts.empty() ? 30 : parse_span_s(ctl.raw.lasts);
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(limit_s);
  for (;;) {
    const std::string problem = not_ready(ctl.raw);
    if (problem.empty()) return 0;
    if (std::chrono::steady_clock::now() >= end) throw StartError(problem);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

int power(Ctl& ctl) {
  Json request = {{"power", ctl.raw.word}};
  ctl.put_ids(request);
  return ctl.direct(std::move(request));
}

int clock(Ctl& ctl) {
  if (ctl.raw.word.empty()) return ctl.show("/clock", clock_line);
  return ctl.ask("PUT", "/clock", {{"mode", ctl.raw.word}}, clock_line);
}

int record(Ctl& ctl) {
  if (ctl.raw.word == "stop") return ctl.ask("DELETE", "/recording", nullptr, recorded_line);
  return ctl.ask("POST", "/recording", {{"directory", absolute(ctl.raw.word)}}, recording_line);
}

int scenario(Ctl& ctl) {
  if (ctl.raw.word == "stop") return ctl.ask("DELETE", "/scenario", nullptr, scenario_page);
  if (ctl.raw.word == "verdict") return ctl.show("/scenario", scenario_page);
  const std::string file = scenario_file(ctl.raw.word);  // before looking for the program
  return ctl.ask("POST", "/scenario", {{"file", file}}, scenario_page);
}

/// A subcommand, and the function that runs it.
struct Row {
  const char* word;
  const char* about;
  int (*run)(Ctl& ctl);
  const char* argument = nullptr;  // name of the word after `word`; null: none
  const char* argument_about = "";
  bool needed = true;
  const char* example = nullptr;
};
constexpr Row kRows[] = {
    {"status", "buses, clock, counters",
     [](Ctl& ctl) { return ctl.show("/status", status_table); }},
    {"drives", "all drives", [](Ctl& ctl) { return ctl.show("/drives", drives_table); }},
    {"drive", "everything about one drive", drive, "ID", "the drive's, 1 to 32"},
    {"watch", "all drives, live; q leaves", [](Ctl& ctl) { return watch_drives(ctl.client()); }},
    {.word = "set",
     .about = "change supply, load or settings of drives (docs/reference/events.md)",
     .run = [](Ctl& ctl) { return ctl.direct(ctl.assignments()); },
     .example = "  lk-emu ctl set supply_V=18 ramp_s=0.5 --ids 1-2\n"
                "  lk-emu ctl set load.tau_gravity_Nm=2 --ids 1\n"},
    {"fault", "inject a fault (lk-emu faults lists them)", fault, "FAULT", "its kind", true,
     "  lk-emu ctl fault drop probability=0.1 --ids 1-2 --for 2s\n"},
    {"faults", "the faults so far, and their effects",
     [](Ctl& ctl) { return ctl.show("/faults", faults_table); }},
    {"advice", "mistakes of the hosts, and their remedies", advice},
    {"send", "send commands or frames to drives, as a host does", send, "COMMAND",
     "a command name of scenarios, a command byte, or a frame: 141#9C00000000000000", true,
     "  lk-emu ctl send position_2 angle_deg=90 --ids 1-4\n"},
    {.word = "wait",
     .about = "wait until lk-emu is ready",
     .run = wait,
     .example = "  lk-emu --bus vcan0 --ids 1 & lk-emu ctl wait --for 10s\n"},
    {"clear", "end a fault, all of a kind, or all",
     [](Ctl& ctl) {
       return ctl.direct({{"clear", ctl.raw.word}});
     },
     "NAME|all", "name or kind of a fault"},
    {"power", "switch the supply", power, "on|off|cycle", "cycle: off, and on again"},
    {"clock", "show or set the clock mode", clock, "MODE",
     "to set: realtime, stepped, or a factor like x10", false},
    {"advance", "advance a stepped clock",
     [](Ctl& ctl) {
       const double by_s = parse_span_s(ctl.raw.word);
       return ctl.ask("POST", "/clock/advance", {{"by_s", by_s}}, time_line);
     },
     "TIME", "10ms, 1.5s, 2min", true, "  lk-emu ctl clock stepped && lk-emu ctl advance 10ms\n"},
    {"record", "record into a directory, or stop", record, "DIR|stop",
     "new or empty, for lk-emu replay"},
    {"scenario", "run a scenario, stop it, or show its verdict", scenario, "SCENARIO|stop|verdict",
     "scenario file or name, as for lk-emu run (docs/guides/scenarios.md)"},
    {"mark", "write a note into log and recording",
     [](Ctl& ctl) {
       return ctl.direct({{"mark", ctl.raw.word}});
     },
     "TEXT", "the note"},
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

}  // namespace

RunCommand declare_ctl(CLI::App& app, Arguments /*arguments*/) {
  const auto raw = std::make_shared<RawCtl>();
  app.require_subcommand(1);
  app.fallthrough();
  app.add_option("--socket", raw->socket, "its control socket (default: the only one)")
      ->type_name("PATH");
  app.add_option("--bus", raw->bus, "the bus, when there are several")->type_name("BUS");
  app.add_flag("--json", raw->json, "print the answer as JSON");
  add_language_option(app, raw->language);
  std::string examples;
  for (const Row& row : kRows) {
    CLI::App* const sub = app.add_subcommand(row.word, row.about);
    add_arguments(*sub, row, *raw);
    std::string notes = "\nTakes --socket, --bus, --json and --lang of lk-emu ctl too.\n";
    if (row.example != nullptr) notes += std::string("\nExample:\n") + row.example;
    sub->footer(notes + kExitStatus);
    if (row.example != nullptr) examples += row.example;
  }
  app.footer("\nExamples:\n" + examples + kExitStatus);
  return [raw, &app] {
    Ctl ctl(*raw);
    return std::ranges::find(kRows, app.get_subcommands().front()->get_name(), &Row::word)
        ->run(ctl);
  };
}

}  // namespace lk::emulator
