// Parses the parameters of a telemetry stream.

#include <algorithm>
#include <charconv>
#include <cmath>

#include "emulator/config/config.hpp"
#include "emulator/control/control_api.hpp"
#include "emulator/core/servo/body_signals.hpp"

namespace lk::emulator {
namespace {

/// "speed_dps,iq_A,body.fallen"
void read_signals(std::string_view names, const BodySignals* body, TelemetryRequest& wanted) {
  const std::vector<const Signal*> known = signals_with(body);
  for (;;) {
    const std::size_t end = names.find(',');
    const std::string name(names.substr(0, end));
    const auto found = std::ranges::find(known, name, &Signal::name);
    if (found == known.end()) {
      const bool bodiless = body == nullptr && name.starts_with(kBodyPrefix);
      throw ApiError(
          400, "signals",
          bodiless ? name + ": the robot has no [body]" : "there is no signal \"" + name + "\"");
    }
    auto& all = (*found)->is_of_body() ? wanted.body_signals : wanted.signals;
    if (std::ranges::find(all, *found) != all.end()) {
      throw ApiError(400, "signals", name + " is given twice");
    }
    all.push_back(*found);
    if (end == std::string_view::npos) return;
    names.remove_prefix(end + 1);
  }
}

}  // namespace

TelemetryRequest ControlApi::read_telemetry_request(const ApiRequest& request) {
  TelemetryRequest wanted;
  std::optional<std::string> bus;
  std::string ids;
  std::string names = "angle_deg,speed_dps,iq_A";
  for (const auto& [key, value] : request.query) {
    if (key == "bus") {
      bus = value;
    } else if (key == "ids") {
      ids = value;
    } else if (key == "signals") {
      names = value;
    } else if (key == "rate_Hz") {
      const char* const last = value.data() + value.size();
      const auto [end, error] = std::from_chars(value.data(), last, wanted.rate_Hz);
      if (error != std::errc() || end != last || !(wanted.rate_Hz >= kSlowestTelemetry_Hz) ||
          !(wanted.rate_Hz <= kFastestTelemetry_Hz)) {
        throw ApiError(400, "rate_Hz", "must be a number from 0.1 to 20000");
      }
    } else if (key == "samples_per_message") {
      const char* const last = value.data() + value.size();
      const auto [end, error] = std::from_chars(value.data(), last, wanted.samples_per_message);
      if (error != std::errc() || end != last || wanted.samples_per_message < 1 ||
          wanted.samples_per_message > kMostSamplesPerMessage) {
        throw ApiError(400, key, "must be a whole number from 1 to 1000");
      }
    } else {
      throw ApiError(400, key,
                     "unknown; there are bus, ids, signals, rate_Hz and samples_per_message");
    }
  }
  wanted.line = &line_of(bus ? &*bus : nullptr);
  try {
    if (!ids.empty()) wanted.ids = parse_ids(ids);
  } catch (const std::invalid_argument& problem) {
    throw ApiError(400, "ids", problem.what());
  }
  for (const int id : wanted.ids) {
    if (!wanted.line->bus().has(id)) {
      throw ApiError(400, "ids", "no drive " + std::to_string(id) + " on this bus");
    }
  }
  if (wanted.ids.empty()) {
    for (const ServoConfig& servo : wanted.line->config().servos) wanted.ids.push_back(servo.id);
  }
  read_signals(names, wanted.line->config().body_signals.get(), wanted);
  if (wanted.rate_Hz * wanted.values() > kMostTelemetry) {
    throw ApiError(400, "rate_Hz", "more than 200000 values per second: ask for fewer");
  }
  wanted.period = SimTime(std::llround(1e9 / wanted.rate_Hz));
  return wanted;
}

}  // namespace lk::emulator
