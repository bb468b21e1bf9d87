// Telemetry: the parameters of a stream, and its samples.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <deque>
#include <iterator>
#include <optional>

#include "emulator/config/config.hpp"
#include "emulator/core/scenario/sampler.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/core/text.hpp"
#include "emulator/io/control/control_api.hpp"
#include "emulator/io/control/control_json.hpp"
#include "emulator/io/control/stream_client.hpp"

namespace lk::emulator {
namespace {

/// Parses a list such as "speed_dps,iq_A,body.fallen" into `wanted`.
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
          bodiless ? name + ": the robot has no [body]" : "unknown signal \"" + name + "\"");
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

TelemetryRequest read_telemetry_request(World& world, const ApiRequest& request) {
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
      const auto samples = number_of(value, 10, kMaxSamplesPerMessage);
      if (samples.value_or(0) < 1) {
        throw ApiError(400, key, "must be a whole number from 1 to 1000");
      }
      wanted.samples_per_message = static_cast<int>(*samples);
    } else if (key == "digits") {
      const auto digits = number_of(value, 10, kExactDigits);
      if (digits.value_or(0) < 1) throw ApiError(400, key, "must be a whole number from 1 to 17");
      wanted.digits = static_cast<int>(*digits);
    } else {
      throw ApiError(400, key,
                     "unknown; known: bus, ids, signals, rate_Hz, samples_per_message and digits");
    }
  }
  wanted.line = &line_of(world, bus ? &*bus : nullptr);
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
  if (wanted.rate_Hz * wanted.values() > kMaxTelemetry) {
    throw ApiError(400, "rate_Hz", "more than 200000 values per second: ask for fewer");
  }
  wanted.period = SimTime(std::llround(1e9 / wanted.rate_Hz));
  return wanted;
}

namespace {

constexpr auto kLongestGather = std::chrono::milliseconds(20);

void append_number(std::string& text, double value, int digits = kExactDigits) {
  if (!std::isfinite(value)) {
    text += "null";
  } else if (digits == kExactDigits) {
    fmt::format_to(std::back_inserter(text), "{}", value);
  } else {
    fmt::format_to(std::back_inserter(text), "{:.{}g}", value, digits);
  }
}

class TelemetryStream : public StreamClient {
 public:
  TelemetryStream(StreamPeer peer, const TelemetryRequest& wanted)
      : StreamClient(std::move(peer), &HttpShared::telemetry_values,
                     wanted.rate_Hz * wanted.values()),
        wanted_(wanted) {}

 private:
  void begin() override {
    std::vector<SampledColumn> columns;
    for (const int id : wanted_.ids) {
      for (const Signal* signal : wanted_.signals) columns.push_back({id, signal});
    }
    const int any = wanted_.line->config().servos.front().id;
    for (const Signal* signal : wanted_.body_signals) columns.push_back({any, signal});
    sampler_.emplace(std::move(columns), wanted_.line->bus().time(), wanted_.period);
    send(introduction());
    // The callbacks hold a weak pointer: the line must not keep a closed stream alive.
    watcher_ = wanted_.line->watchers.insert(wanted_.line->watchers.end(),
                                             {[this, weak = weak_from_this()] {
                                                const auto self = weak.lock();
                                                return self ? sampler_->next_due() : SimTime::max();
                                              },
                                              [this, weak = weak_from_this()](const Bus& bus) {
                                                if (const auto self = weak.lock()) sample(bus);
                                              }});
  }

  std::string introduction() const {
    Json names = Json::array();
    for (const Signal* signal : wanted_.signals) names.push_back(signal->name);
    Json json = {{"bus", wanted_.line->name()},
                 {"ids", wanted_.ids},
                 {"signals", names},
                 {"rate_Hz", wanted_.rate_Hz}};
    for (const Signal* signal : wanted_.body_signals) json["body"].push_back(signal->name);
    return json.dump();
  }

  void sample(const Bus& bus) {
    sampler_->sample(bus, row_);
    if (queued_ + gathered_.size() > kMaxQueued) {
      ++lost_;
      return;
    }
    std::string& text = gathered_;
    text += gathered_samples_++ == 0 ? "" : ",";
    text += "{\"time_s\":";
    append_number(text, in_seconds(bus.time()));
    if (lost_ > 0) fmt::format_to(std::back_inserter(text), ",\"lost\":{}", lost_);
    text += ",\"rows\":[";
    auto value = row_.begin();
    for (const int id : wanted_.ids) {
      fmt::format_to(std::back_inserter(text), "{}[{}", value == row_.begin() ? "" : ",", id);
      for (std::size_t n = 0; n < wanted_.signals.size(); ++n) {
        text += ',';
        append_number(text, *value++, wanted_.digits);
      }
      text += ']';
    }
    text += ']';
    for (auto left = value; value != row_.end(); ++value) {
      text += value == left ? ",\"body\":[" : ",";
      append_number(text, *value, wanted_.digits);
    }
    text += wanted_.body_signals.empty() ? "}" : "]}";
    if (gathered_samples_ >= wanted_.samples_per_message) {
      send_gathered();
    } else if (gathered_samples_ == 1) {
      do_after(kLongestGather, [this] { send_gathered(); });
    }
  }

  void send_gathered() {
    if (gathered_samples_ == 0) return;
    gathered_samples_ = 0;
    if (wanted_.samples_per_message > 1) {
      send("[" + std::exchange(gathered_, {}) + "]");
    } else {
      send(std::exchange(gathered_, {}));
    }
  }

  void send(std::string text) {
    queued_ += text.size();
    queue_.push_back(std::move(text));
    if (queue_.size() == 1) write(queue_.front());
  }

  void on_written() override {
    queued_ -= queue_.front().size();
    queue_.pop_front();
    if (!queue_.empty()) write(queue_.front());
  }

  void end() override {
    if (watcher_) wanted_.line->watchers.erase(*watcher_);
    watcher_.reset();
  }

  TelemetryRequest wanted_;
  std::optional<Sampler> sampler_;
  std::optional<Line::WatcherKey> watcher_;
  std::vector<double> row_;
  std::string gathered_;  // samples of the next message
  int gathered_samples_ = 0;
  std::deque<std::string> queue_;
  std::size_t queued_ = 0;  // bytes
  std::uint64_t lost_ = 0;  // samples dropped since the stream began
};

}  // namespace

void stream_telemetry(StreamPeer peer, const TelemetryRequest& wanted) {
  std::make_shared<TelemetryStream>(std::move(peer), wanted)->start();
}

}  // namespace lk::emulator
