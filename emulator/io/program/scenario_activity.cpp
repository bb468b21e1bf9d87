#include "emulator/io/program/scenario_activity.hpp"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <filesystem>
#include <utility>

#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/files/profile_files.hpp"
#include "emulator/monitor/scenario/scenario_report.hpp"
#include "emulator/monitor/scenario/scenario_runner.hpp"

namespace lk::emulator {
namespace {

Json seconds_or_null(const std::optional<SimTime>& time) {
  return time ? Json(in_seconds(*time)) : Json(nullptr);
}

Json expectation_json(const ExpectationResult& result) {
  return {{"status", status_word(result.status)},
          {"expected", result.expected},
          {"measured", result.measured},
          {"says", result.description},
          {"at_s", seconds_or_null(result.at)},
          {"decided_at_s", seconds_or_null(result.decided_at)},
          {"margin", result.margin ? Json(*result.margin) : Json(nullptr)}};
}

Json planned_json(const PlannedFault& fault) {
  return {{"bus", fault.bus},
          {"name", fault.report.fault.name},
          {"kind", fault.report.fault.row->word},
          {"took_effect", fault.took_effect()},
          {"began_at_s", seconds_or_null(fault.report.evidence.began_at)},
          {"first_effect_at_s", seconds_or_null(fault.report.evidence.first_effect_at)},
          {"effects", fault.report.evidence.effects},
          {"first_on", fault.report.evidence.first_on},
          {"evidence", fault_sentence(fault)}};
}

Json errors_json(const BusAccount& account) {
  Json json = Json::array();
  for (const FirstError& first : account.errors) {
    json.push_back({{"bus", account.bus},
                    {"id", first.id},
                    {"error", error_word(first.error)},
                    {"at_s", in_seconds(first.at)}});
  }
  return json;
}

/// Writes the hash as text, as many JSON readers cannot hold 64-bit numbers.
Json account_json(const BusAccount& account) {
  return {{"bus", account.bus},
          {"started_s", in_seconds(account.start)},
          {"replies", account.replies},
          {"replies_hash", fmt::format("{:016x}", account.replies_hash)}};
}

std::vector<BusConfig> running(const World& world) {
  std::vector<BusConfig> buses;
  for (const auto& line : world.lines()) buses.push_back(line->config());
  return buses;
}

/// Throws unless `file` is a shipped scenario: other users must not learn which other files exist,
/// or what they contain.
void check_shipped(const std::string& file) {
  for (const std::string& name : known_files(kScenarios)) {
    if (file == name || file == shipped_file(kScenarios, name)) return;
  }
  throw ApiError(403, "file", "is not a shipped scenario: over TCP send its text, as \"toml\"");
}

}  // namespace

std::vector<Line*> ScenarioActivity::lines() const {
  std::vector<Line*> all;
  for (const auto& line : world_.lines()) all.push_back(line.get());
  return all;
}

void ScenarioActivity::check_room(const Scenario& scenario) const {
  emulator::check_room(scenario, lines());
}

void ScenarioActivity::start(Scenario scenario, std::function<void()> on_over) {
  check_room(scenario);  // throws before the last scenario and its verdict are gone
  finish();
  live_.reset();
  const unsigned number = ++number_;
  planned_ = static_cast<bool>(on_over);
  const auto end = [this, number, over = std::move(on_over)] {
    // Posted to the loop, as `finish` must not be called from a line. Meanwhile the scenario may
    // have been stopped, or replaced.
    boost::asio::post(loop_, [this, number, over] {
      if (number != number_ || !live_->running()) return;
      finish();
      if (over) over();
    });
  };
  live_.emplace(std::move(scenario), lines(), end,
                [this] { return world_.coupling() ? world_.coupling()->failure() : std::nullopt; });
}

void ScenarioActivity::finish() {
  if (live_) live_->finish();
}

std::optional<RunReport> ScenarioActivity::report() const {
  return live_ ? std::optional(live_->report()) : std::nullopt;
}

Activity ScenarioActivity::for_clients() {
  return {.start = [this](TableReader& request,
                          bool same_user) { return start_for_client(request, same_user); },
          .stop =
              [this] {
                if (planned_) {
                  throw ApiError(
                      409, "scenario",
                      "the program runs for this scenario (--scenario): stop the program");
                }
                finish();
                return report_json();
              },
          .state = [this] { return state(); },
          .report = [this] { return report_json(); }};
}

Json ScenarioActivity::start_for_client(TableReader& request, bool same_user) {
  if (planned_) {
    throw ApiError(409, "scenario", "the program runs for a scenario of its own (--scenario)");
  }
  if (live_ && live_->running()) {
    throw ApiError(409, "scenario", live_->scenario().name + " is running; stop it first");
  }
  const auto file = request.text("file");
  const auto toml = request.text("toml");
  request.finish();
  if (file.has_value() == toml.has_value()) {
    throw ApiError(400, "scenario", R"(needs either "file" or "toml", and nothing else)");
  }
  if (file && !same_user) check_shipped(*file);
  std::error_code none_there;
  const auto size = file ? std::filesystem::file_size(*file, none_there) : 0;
  if (!none_there && size > kLongestFile) {
    throw ApiError(400, "file",
                   "is longer than " + std::to_string(kLongestFile) +
                       " bytes; the drives would wait while it is read (--scenario takes it)");
  }
  try {
    const std::vector<BusConfig> buses = running(world_);
    // Limits the size of logs too, as one line of a scenario can play a whole log.
    const FileLimits limits{
        .each = kLongestFile, .played = kLongestFile, .no_logs = !same_user && toml};
    start(file ? load_live_scenario(*file, buses, limits)
               : parse_live_scenario(*toml, "request", buses, scenario_files("", limits)),
          {});
  } catch (const StartError& problem) {
    throw ApiError(400, "file", problem.what());
  } catch (const std::invalid_argument& problem) {
    throw ApiError(409, "scenario", problem.what());
  }
  return state();
}

Json ScenarioActivity::state() const {
  if (!live_) return nullptr;
  const RunReport report = live_->report();
  return {{"name", report.name},
          {"state", live_->running() ? "running" : outcome_word(report.verdict.outcome)},
          {"time_s", in_seconds(report.simulated)},
          {"duration_s", in_seconds(live_->scenario().duration)}};
}

Json ScenarioActivity::report_json() const {
  if (!live_) throw ApiError(404, "scenario", "none was started");
  const RunReport report = live_->report();
  Json json = state();
  json["about"] = report.about;
  json["robot"] = live_->scenario().robot_name;
  json["foreign"] = Json::array();
  for (const DriveMismatch& drive : live_->scenario().mismatches) {
    json["foreign"].push_back(
        {{"bus", drive.bus}, {"id", drive.id}, {"meant", drive.meant}, {"running", drive.running}});
  }
  json["expectations"] = Json::array();
  json["faults"] = Json::array();
  for (const auto& result : report.verdict.expectations) {
    json["expectations"].push_back(expectation_json(result));
  }
  for (const auto& fault : report.verdict.faults) json["faults"].push_back(planned_json(fault));
  json["invalid"] = report.verdict.invalid;
  json["unasked_deg"] = report.verdict.unasked.motion.deg;
  json["errors"] = Json::array();
  json["buses"] = Json::array();
  for (const BusAccount& account : report.accounts) {
    for (const Json& error : errors_json(account)) json["errors"].push_back(error);
    json["buses"].push_back(account_json(account));
  }
  return json;
}

}  // namespace lk::emulator
