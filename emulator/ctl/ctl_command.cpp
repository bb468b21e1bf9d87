#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "emulator/ctl/ctl_client.hpp"
#include "emulator/ctl/ctl_tables.hpp"
#include "emulator/ctl/ctl_watch.hpp"
#include "emulator/ctl/ctl_words.hpp"
#include "emulator/program/cli.hpp"
#include "emulator/program/commands.hpp"
#include "emulator/program/language_option.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kFooter = R"(
Examples:
  lk-emu ctl set ids=1-2 supply_V=18 ramp_s=0.5
  lk-emu ctl fault drop probability=0.1 --ids 1-2 --for 2
  lk-emu ctl set id=1 load.tau_gravity_Nm=2
  lk-emu ctl clock stepped && lk-emu ctl advance 10ms

Exit status: 0 done, 1 refused, or the answer could not be printed, 2 unusable input or nobody answers.)";

struct Raw {
  std::string socket;
  std::string bus;
  bool json = false;
  int id = 0;
  std::string word;
  std::vector<std::string> words;
  std::string ids;
  std::optional<double> at_s;
  std::optional<double> for_s;
  std::string language;
};

using Answer = CtlClient::Answer;

class Ctl {
 public:
  explicit Ctl(const Raw& raw) : raw_(raw), client_(find_socket(raw.socket, raw.bus)) {}

  int status() { return show(client_.ask("GET", "/status"), status_table); }
  int drives() { return show(client_.ask("GET", "/drives"), drives_table); }
  int faults() { return show(client_.ask("GET", "/faults"), faults_table); }
  int advice() {
    const bool chinese = chosen_language(raw_.language) == Language::kChinese;
    return show(client_.ask("GET", "/advice"), chinese ? advice_table_zh : advice_table_en);
  }
  int drive() { return show(client_.ask("GET", drive_path()), drive_page); }
  int watch() { return watch_drives(client_); }

  int set() {
    Json said = Json::object();
    for (const std::string& word : raw_.words) put_word(said, word);
    return direct(std::move(said));
  }

  int fault() {
    Json said = Json::object();
    Json fault = {{"kind", raw_.word}};  // not in its place yet: what is in `said` moves
    for (const std::string& word : raw_.words) {
      const bool of_event = word.starts_with("id=") || word.starts_with("ids=") ||
                            word.starts_with("at_s=") || word.starts_with("when.");
      put_word(of_event ? said : fault, word);
    }
    if (!raw_.ids.empty()) said["ids"] = raw_.ids;
    if (raw_.at_s) said["at_s"] = *raw_.at_s;
    if (raw_.for_s) fault["for_s"] = *raw_.for_s;
    said["fault"] = std::move(fault);
    return direct(std::move(said));
  }

  int clear() { return direct({{"clear", raw_.word}}); }
  int mark() { return direct({{"mark", raw_.word}}); }

  int power() {
    Json said = {{"power", raw_.word}};
    if (!raw_.ids.empty()) said["ids"] = raw_.ids;
    return direct(std::move(said));
  }

  int clock() {
    return show(raw_.word.empty() ? client_.ask("GET", "/clock")
                                  : client_.ask("PUT", "/clock", {{"mode", raw_.word}}),
                clock_line);
  }

  int advance() {
    return show(client_.ask("POST", "/clock/advance", {{"by_s", parse_span_s(raw_.word)}}),
                time_line);
  }

  int record() {
    if (raw_.word == "stop") return show(client_.ask("DELETE", "/recording"), plain);
    return show(client_.ask("POST", "/recording", {{"directory", absolute(raw_.word)}}), plain);
  }

  int scenario() {
    if (raw_.word == "stop") return show(client_.ask("DELETE", "/scenario"), plain);
    if (raw_.word == "verdict") return show(client_.ask("GET", "/scenario"), plain);
    return show(client_.ask("POST", "/scenario", {{"file", absolute(raw_.word)}}), plain);
  }

 private:
  /// lk-emu stands somewhere else.
  static std::string absolute(const std::string& path) {
    return std::filesystem::absolute(path).lexically_normal().string();
  }
  static std::string plain(const Json& json) { return json.dump(2) + "\n"; }
  static std::string time_line(const Json& json) {
    return std::to_string(json.value("time_s", 0.0)) + " s\n";
  }
  static std::string clock_line(const Json& json) {
    return json.value("mode", std::string()) + ", " + time_line(json);
  }
  static std::string done_line(const Json& json) {
    std::string text = "at " + time_line(json);
    for (const Json& name : json.value("faults", Json::array())) {
      text += "fault " + name.get<std::string>() + "\n";
    }
    return text;
  }

  std::string drive_path() const {
    std::string bus = raw_.bus;
    if (bus.empty()) {
      const Json status = client_.ask("GET", "/status").body;
      if (status["buses"].size() > 1) throw StartError("ctl: there are several buses: give --bus");
      bus = status["buses"][0].value("bus", "");
    }
    return "/drives/" + bus + "/" + std::to_string(raw_.id);
  }

  int direct(Json said) {
    if (!raw_.bus.empty() && !said.contains("bus")) said["bus"] = raw_.bus;
    return show(client_.ask("POST", "/directives", said), done_line);
  }

  int show(const Answer& answer, std::string (*table)(const Json&)) const {
    if (answer.status >= 300) {
      const Json error = answer.body.value("error", Json::object());
      std::fprintf(stderr, "lk-emu: %s: %s\n", error.value("where", std::string("?")).c_str(),
                   error.value("reason", std::string("refused")).c_str());
      return 1;
    }
    std::fputs((raw_.json ? answer.body.dump(2) + "\n" : table(answer.body)).c_str(), stdout);
    return 0;
  }

  const Raw& raw_;
  CtlClient client_;
};

/// What each word does, and the member that does it.
struct Row {
  const char* word;
  const char* about;
  int (Ctl::*run)();
  const char* argument;  // the one that follows; null: none
  bool needed;
};
constexpr Row kRows[] = {
    {"status", "buses, clock, counters", &Ctl::status, nullptr, false},
    {"drives", "all drives", &Ctl::drives, nullptr, false},
    {"drive", "everything about one drive", &Ctl::drive, nullptr, false},
    {"watch", "all drives, live; q leaves", &Ctl::watch, nullptr, false},
    {"set", "do something to drives, in the words of docs/configuration.md: KEY=VALUE…", &Ctl::set,
     nullptr, false},
    {"fault", "inject a fault (lk-emu faults lists them)", &Ctl::fault, "FAULT", true},
    {"faults", "the faults there have been, and what came of them", &Ctl::faults, nullptr, false},
    {"advice", "what hosts do wrong, and what to do", &Ctl::advice, nullptr, false},
    {"clear", "end a fault, all of a kind, or all", &Ctl::clear, "NAME|all", true},
    {"power", "switch the supply", &Ctl::power, "on|off|cycle", true},
    {"clock", "show, or set, how time goes by", &Ctl::clock, "MODE", false},
    {"advance", "let a stepped clock move: 10ms, 1s", &Ctl::advance, "TIME", true},
    {"record", "record into a directory, or stop", &Ctl::record, "DIR|stop", true},
    {"scenario", "run a scenario, stop it, or show its verdict", &Ctl::scenario,
     "FILE|stop|verdict", true},
    {"mark", "put a note into log and recording", &Ctl::mark, "TEXT", true},
};

void add_arguments(CLI::App& sub, const Row& row, Raw& raw) {
  const std::string word = row.word;
  if (row.argument != nullptr) {
    sub.add_option("WORD", raw.word, row.argument)->type_name(row.argument)->required(row.needed);
  }
  if (word == "advice") add_language_option(sub, raw.language);
  if (word == "drive") sub.add_option("ID", raw.id, "its ID")->type_name("ID")->required();
  if (word == "set")
    sub.add_option("WORDS", raw.words, "KEY=VALUE…")->type_name("KEY=VALUE")->required();
  if (word == "fault") sub.add_option("WORDS", raw.words, "its parameters")->type_name("KEY=VALUE");
  if (word == "fault" || word == "power") {
    sub.add_option("--ids", raw.ids, "drives, e.g. 1-2 (default all)")->type_name("LIST");
  }
  if (word == "fault") {
    sub.add_option("--at", raw.at_s, "simulated time at which it begins, in s (default now)")
        ->type_name("S");
    sub.add_option("--for", raw.for_s, "how long it lasts, in s")->type_name("S");
  }
}

struct CtlApp {
  CLI::App app{"Looks at a running lk-emu and acts on it", "lk-emu ctl"};
  Raw raw;
  std::vector<CLI::App*> subs;  // for each row

  CtlApp() {
    app.footer(kFooter);
    app.require_subcommand(1);
    app.fallthrough();
    app.add_option("--socket", raw.socket, "its control socket (default: the only one there is)")
        ->type_name("PATH");
    app.add_option("--bus", raw.bus, "the bus that is meant, when there are several")
        ->type_name("BUS");
    app.add_flag("--json", raw.json, "print the answer as it is");
    for (const Row& row : kRows) {
      subs.push_back(app.add_subcommand(row.word, row.about));
      add_arguments(*subs.back(), row, raw);
    }
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
