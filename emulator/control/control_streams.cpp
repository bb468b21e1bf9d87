// Of the control interface: what comes again and again, over WebSockets.

#include <algorithm>
#include <charconv>
#include <cmath>

#include "emulator/config/config.hpp"
#include "emulator/control/control_api.hpp"

namespace lk::emulator {
namespace {

std::vector<std::string> words_of(std::string_view list) {
  std::vector<std::string> words;
  for (;;) {
    const std::size_t end = list.find(',');
    words.emplace_back(list.substr(0, end));
    if (end == std::string_view::npos) return words;
    list.remove_prefix(end + 1);
  }
}

/// All of `text` as a number; false when it is none.
template <class Number>
bool read_number(const std::string& text, Number& number) {
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  return error == std::errc() && end == last;
}

}  // namespace

/// Whoever may listen to a stream asks for an upgrade, and does not come here.
void ControlApi::get_telemetry(const ApiRequest& request, const Parts& /*parts*/,
                               const Reply& reply) {
  read_telemetry_request(request);
  reply(error_response(426, "Upgrade", "telemetry comes over a WebSocket"));
}

void ControlApi::get_frames(const ApiRequest& request, const Parts& /*parts*/, const Reply& reply) {
  read_frames_request(request);
  reply(error_response(426, "Upgrade", "frames come over a WebSocket"));
}

Line& ControlApi::read_frames_request(const ApiRequest& request) {
  const std::string* bus = nullptr;
  for (const auto& [key, value] : request.query) {
    if (key != "bus") throw ApiError(400, key, "unknown; there is bus");
    bus = &value;
  }
  return line_of(bus);
}

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
      if (!read_number(value, wanted.rate_Hz) || !(wanted.rate_Hz >= kSlowestTelemetry_Hz) ||
          !(wanted.rate_Hz <= kFastestTelemetry_Hz)) {
        throw ApiError(400, "rate_Hz", "must be a number from 0.1 to 20000");
      }
    } else if (key == "samples_per_message") {
      if (!read_number(value, wanted.samples_per_message) || wanted.samples_per_message < 1 ||
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
  for (const std::string& name : words_of(names)) {
    const Signal* const signal = find_signal(name);
    if (signal == nullptr) throw ApiError(400, "signals", "there is no signal \"" + name + "\"");
    if (std::ranges::find(wanted.signals, signal) != wanted.signals.end()) {
      throw ApiError(400, "signals", name + " is given twice");
    }
    wanted.signals.push_back(signal);
  }
  const double values =
      wanted.rate_Hz * static_cast<double>(wanted.ids.size() * wanted.signals.size());
  if (values > kMostTelemetry) {
    throw ApiError(400, "rate_Hz", "more than 200000 values a second; ask for less");
  }
  wanted.period = SimTime(std::llround(1e9 / wanted.rate_Hz));
  return wanted;
}

}  // namespace lk::emulator
