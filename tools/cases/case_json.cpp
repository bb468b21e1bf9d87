#include <fmt/format.h>

#include "emulator/core/text.hpp"
#include "tools/cases/case_batch.hpp"

namespace lk::emulator {
namespace {

void add_time(Json& json, const char* key, const std::optional<SimTime>& time) {
  if (time) json[key] = time->count();
}

Json result_json(const ExpectationResult& result) {
  Json json{{"says", result.description.empty() ? result.expected : result.description},
            {"status", status_word(result.status)},
            {"measured", result.measured}};
  add_time(json, "at_ns", result.at);
  add_time(json, "decided_at_ns", result.decided_at);
  if (result.margin) json["margin"] = *result.margin;
  return json;
}

Json fault_json(const CaseRun& one) {
  const std::string& bus = one.course->scenario.robot[one.fault.front().bus].interface;
  Json json{{"state", one.state}, {"command", one.command}};
  for (const PlannedFault& planned : one.verdict.faults) {
    if (planned.bus != bus || planned.report.fault.name != one.fault_name) continue;
    add_time(json, "began_at_ns", planned.report.evidence.began_at);
    add_time(json, "first_effect_at_ns", planned.report.evidence.first_effect_at);
    json["effects"] = planned.report.evidence.effects;
  }
  return json;
}

/// Returns the watched error bits that were set in the run.
Json errors_json(const CaseRun& one) {
  Json errors = Json::array();
  const Scenario& scenario = one.course->scenario;
  for (std::size_t n = 0; n < one.course->drive_errors; ++n) {
    const std::size_t place = one.course->own + n;
    const Expectation& watched = scenario.expectations[place];
    const ExpectationResult& result = one.verdict.expectations[one.course->places[place]];
    if (result.status != ExpectationResult::Status::kPassed) continue;
    Json error{{"bus", scenario.robot[watched.bus].interface},
               {"id", watched.id},
               {"error", one.request->drive_errors[n % one.request->drive_errors.size()]}};
    add_time(error, "at_ns", result.at);
    errors.push_back(std::move(error));
  }
  return errors;
}

Json results_json(const CaseRun& one) {
  Json json{{"case", one.request->number}};
  if (!one.fault.empty()) json["fault"] = fault_json(one);
  json["replies"] = fmt::format("{:016x}", one.watch.reply_hash());
  const auto results = [&](std::size_t from, std::size_t to) {
    Json list = Json::array();
    for (std::size_t n = from; n < to; ++n) {
      list.push_back(result_json(one.verdict.expectations[one.course->places[n]]));
    }
    return list;
  };
  const std::size_t watched = one.course->own + one.course->drive_errors;
  json["expect"] = results(0, one.course->own);
  json["errors"] = errors_json(one);
  json["detect"] = results(watched, one.course->places.size());
  json["unasked_deg"] = one.verdict.unasked.motion.deg;
  if (!one.verdict.invalid.empty()) json["invalid"] = one.verdict.invalid;
  return json;
}

}  // namespace

std::string results_json(std::span<const CaseRun> cases) {
  std::string lines;
  for (const CaseRun& one : cases) lines += results_json(one).dump() + '\n';
  return lines;
}

std::string possible_json(const CaseRun& one) {
  const Scenario& scenario = one.course->scenario;
  Json drives = Json::array();
  for (const BusConfig& bus : scenario.robot) {
    for (const ServoConfig& servo : bus.servos) {
      drives.push_back({{"bus", bus.interface}, {"id", servo.id}, {"motor", servo.profile.name}});
    }
  }
  Json expectations = Json::array();
  for (std::size_t n = 0; n < one.course->own; ++n) {
    expectations.push_back(scenario.expectations[n].description);
  }
  return Json{{"case", one.request->number},
              {"inputs", fmt::format("{:016x}", one.course->inputs)},
              {"duration_s", in_seconds(scenario.duration)},
              {"drives", std::move(drives)},
              {"expect", std::move(expectations)}}
             .dump() +
         '\n';
}

std::string impossible_json(std::uint64_t number, const std::string& reason) {
  return Json{{"case", number}, {"error", sanitized_line(reason)}}.dump() + '\n';
}

}  // namespace lk::emulator
