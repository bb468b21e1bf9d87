#include <cmath>
#include <nlohmann/json.hpp>

#include "emulator/core/frame_text.hpp"
#include "emulator/core/generation.hpp"
#include "emulator/monitor/frames/decode_words.hpp"
#include "tools/decode/decode_output.hpp"

namespace lk::emulator {
namespace {

using Json = nlohmann::ordered_json;

std::string line(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

double ms_of(SimTime time) { return static_cast<double>(time.count()) / 1e6; }

/// Returns a JSON number: an integer, without a decimal point, if the value is whole.
Json number(double value) {
  constexpr double kExact = 9007199254740992.0;  // 2^53
  if (std::round(value) == value && std::abs(value) <= kExact) {
    return static_cast<std::int64_t>(value);
  }
  return value;
}

/// Words for Role, in its order.
constexpr const char* kRoleWords[] = {"query", "reply", "unclear", "other"};

Json latency_json(const LatencyHistogram& latency) {
  return {{"count", latency.count()},
          {"min", ms_of(latency.min())},
          {"median", ms_of(latency.quantile(0.5))},
          {"p99", ms_of(latency.quantile(0.99))},
          {"max", ms_of(latency.max())}};
}

Json command_json(int drive, std::uint32_t asked, const CommandTally& command,
                  const BusTally& bus) {
  Json json = {{"drive", drive},
               {"command", command_text(asked)},
               {"name", command_name(asked, bus.framing)},
               {"queries", command.queries},
               {"replies", command.replies},
               {"unanswered", command.unanswered},
               {"open", command.open},
               {"unclear", command.unclear},
               {"without_query", command.orphans}};
  if (const auto rate = bus.rate_Hz(command)) json["rate_Hz"] = *rate;
  if (command.latency.count() > 0) json["latency_ms"] = latency_json(command.latency);
  return json;
}

Json bus_json(const std::string& interface, const BusTally& bus) {
  Json json = {{"interface", interface}, {"frames", bus.frames}};
  if (bus.first_at) json["first_time_s"] = in_seconds(*bus.first_at);
  if (const auto duration = bus.duration_s()) json["duration_s"] = *duration;
  Json commands = Json::array();
  Json errors = Json::array();
  Json meaningless = Json::object();
  for (const auto& [key, command] : bus.commands) {
    commands.push_back(command_json(key.first, key.second, command, bus));
  }
  for (const auto& [key, error] : bus.errors) {
    Json one = {{"drive", key.first}, {"error", key.second}, {"replies", error.replies}};
    if (error.first_at) one["first_time_s"] = in_seconds(*error.first_at);
    errors.push_back(std::move(one));
  }
  for (const auto& [why, count] : bus.meaningless) meaningless[std::string(why)] = count;
  json["commands"] = std::move(commands);
  json["errors"] = std::move(errors);
  json["meaningless"] = std::move(meaningless);
  json["commands_of_other_generations"] = bus.of_newer_firmware;
  return json;
}

}  // namespace

std::string frame_json(const DecodedFrame& frame) {
  const FrameInfo& info = frame.info;
  const FrameWords& words = frame.words;
  Json json = {{"type", "frame"}, {"line", frame.line}};
  if (frame.at) json["time_s"] = in_seconds(*frame.at);
  json["interface"] = frame.interface;
  json["frame"] = frame_text(frame.frame);
  json["role"] = kRoleWords[static_cast<std::size_t>(info.role)];
  if (info.role != Role::kOther) {
    json["sure"] = info.sure;
    json["drive"] = info.drive;
    json["command"] = words.command;
    json["name"] = words.name;
    Json values = Json::object();
    for (const ReplyValue& one : words.quantities) {
      values[std::string(one.name)] = number(one.value);
      if (one.name == "errors") {
        values["error_words"] = error_words(static_cast<unsigned>(one.value));
      }
    }
    json["values"] = std::move(values);
  }
  if (info.role == Role::kReply) {
    json["choices"] = info.match_count;
    if (info.latency) json["latency_ms"] = ms_of(*info.latency);
  }
  if (!words.mark.empty()) json["mark"] = words.mark;
  if (!words.problem.empty()) json["drawback"] = words.problem;
  if (frame.frame.kind == protocol::FrameKind::kError) {
    json["error_words"] = error_frame_words(frame.frame.id);
  }
  return line(json);
}

std::string bad_line_json(std::uint64_t number_of_line, const std::string& problem) {
  return line({{"type", "bad_line"}, {"line", number_of_line}, {"problem", problem}});
}

std::string steps_json(std::uint64_t number_of_line) {
  return line({{"type", "stamps_are_steps"}, {"line", number_of_line}});
}

std::string summary_json(const DecodeSummary& summary, const DecodeOptions& options) {
  Json buses = Json::array();
  for (const auto& [interface, bus] : summary.buses) buses.push_back(bus_json(interface, bus));
  Json json = {{"type", "summary"},
               {"frames", summary.frames},
               {"bad_lines", summary.bad_lines},
               {"generation", generation_name(options.generation)},
               {"generation_assumed", !options.generation_given},
               {"motor", options.profile.name},
               {"motor_assumed", !options.motor_given},
               {"stamps_are_steps", summary.steps},
               {"odd_states", summary.odd_states},
               {"buses", std::move(buses)}};
  if (!options.buses.empty()) {  // in a recording, drives differ in generation and motor
    for (const char* key : {"generation", "generation_assumed", "motor", "motor_assumed"}) {
      json.erase(key);
    }
  }
  return line(json);
}

}  // namespace lk::emulator
