#include "tools/identify/track.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <stdexcept>
#include <variant>

#include "emulator/config/config.hpp"
#include "emulator/core/generation.hpp"
#include "emulator/core/servo/shaft_angles.hpp"
#include "emulator/frames/candump_text.hpp"
#include "emulator/frames/log_pairing.hpp"
#include "emulator/frames/reply_values.hpp"
#include "protocol/codec.hpp"
#include "tools/guess/guesser.hpp"

namespace lk::emulator {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr double kCentideg = kDeg / 100;
constexpr double kGapSteps = 5;
/// Between two logs of one drive.
constexpr double kBetweenLogs_s = 3600;

double seconds(SimTime time) { return std::chrono::duration<double>(time).count(); }

/// Calls `take` with each line of a text, without its end.
template <class Take>
void each_line(std::string_view text, Take take) {
  while (!text.empty()) {
    const std::size_t length = std::min(text.find('\n'), text.size());
    take(text.substr(0, length));
    text.remove_prefix(std::min(length + 1, text.size()));
  }
}

/// The frames of each interface, in the order of their times.
std::map<std::string, std::vector<LoggedFrame>> frames_of(std::string_view log) {
  std::map<std::string, std::vector<LoggedFrame>> buses;
  StampReader stamps;
  int number = 0;
  each_line(log, [&](std::string_view line) {
    ++number;
    const auto parsed = parse_candump_text(line);
    const auto* shown = std::get_if<ShownFrame>(&parsed);
    if (shown == nullptr) return;
    const auto at = stamps.time_of(*shown);
    if (!at) throw std::invalid_argument("has no time stamps; candump -L writes them");
    buses[shown->line.interface].push_back(
        {{*at, shown->line.frame}, from_host(shown->line.direction), number});
  });
  for (auto& [interface, frames] : buses) {
    std::ranges::stable_sort(frames, {}, [](const LoggedFrame& one) { return one.timed.at; });
  }
  return buses;
}

TrackOrder increment(double at_s, std::int64_t angle_cdeg, double limit_dps) {
  return {at_s, Follows::kPosition, static_cast<double>(angle_cdeg) * kCentideg, limit_dps * kDeg,
          false};
}

/// What a command has the drive follow; none: it goes on as before.
std::optional<TrackOrder> order_of(const protocol::Command& command, double at_s) {
  using namespace protocol;
  const auto position = [at_s](std::int64_t target_cdeg, double limit_dps) {
    return TrackOrder{at_s, Follows::kPosition, static_cast<double>(target_cdeg) * kCentideg,
                      limit_dps * kDeg};
  };
  const auto nothing = TrackOrder{at_s};
  if (const auto* c = std::get_if<Torque>(&command))
    return TrackOrder{at_s, Follows::kTorque, c->iq_A};
  if (const auto* c = std::get_if<Speed>(&command))
    return TrackOrder{at_s, Follows::kSpeed, c->speed_dps * kDeg};
  if (const auto* c = std::get_if<Position1>(&command)) return position(c->target_cdeg, 0);
  if (const auto* c = std::get_if<Position2>(&command))
    return position(c->target_cdeg, c->max_speed_dps);
  if (const auto* c = std::get_if<Position5>(&command))
    return increment(at_s, c->increment_cdeg, 0);
  if (const auto* c = std::get_if<Position6>(&command))
    return increment(at_s, c->increment_cdeg, c->max_speed_dps);
  if (std::holds_alternative<Position3>(command) || std::holds_alternative<Position4>(command))
    return increment(at_s, 0, 0);
  const bool stops =
      std::holds_alternative<Off>(command) || std::holds_alternative<Stop>(command) ||
      std::holds_alternative<Run>(command) || std::holds_alternative<OpenLoop>(command) ||
      std::holds_alternative<Calibrate>(command) || std::holds_alternative<Restart>(command);
  return stops ? std::optional(nothing) : std::nullopt;
}

std::optional<protocol::PidGains> written_gains(const protocol::Command& command) {
  if (const auto* c = std::get_if<protocol::WritePidToRam>(&command)) return c->gains;
  if (const auto* c = std::get_if<protocol::WritePidToRom>(&command)) return c->gains;
  return std::nullopt;
}

/// Encoder counts to an angle that goes on over turns of its span: the way that the reported speed
/// says, or the short one.
class Unwrapper {
 public:
  explicit Unwrapper(const ServoConfig& servo, double counts)
      : span_rad_(2 * std::numbers::pi * encoder_turns(servo.profile, servo.quirks)),
        counts_(counts) {}

  double angle_rad(const TrackSample& now, double counts) {
    const double within_rad = counts / counts_ * span_rad_;
    const double speed_rad_s = (now.speed_rad_s + before_.speed_rad_s) / 2;
    const double expected_rad =
        begun_ ? before_.angle_rad + speed_rad_s * (now.time_s - before_.time_s) : within_rad;
    before_ = now;
    before_.angle_rad = expected_rad + std::remainder(within_rad - expected_rad, span_rad_);
    begun_ = true;
    return before_.angle_rad;
  }

 private:
  double span_rad_;
  double counts_;
  bool begun_ = false;
  TrackSample before_;
};

double median_step_s(const std::vector<TrackSample>& samples) {
  std::vector<double> steps;
  for (std::size_t n = 1; n < samples.size(); ++n) {
    steps.push_back(samples[n].time_s - samples[n - 1].time_s);
  }
  if (steps.empty()) return 0;
  std::ranges::nth_element(steps, steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2));
  return steps[steps.size() / 2];
}

void read_samples(const PairedLog& log, SimTime first, Track& track) {
  const ReplyReader reader(track.servo);
  Unwrapper unwrapper(track.servo, reader.encoder_counts);
  const std::uint32_t own_id =
      reader.format.dialect.reply_id_base + static_cast<std::uint32_t>(reader.id);
  double voltages_V = 0;
  int voltages = 0;
  for (const Exchange& exchange : log.exchanges) {
    const TimedFrame& query = log.sent[exchange.query];
    const double at_s = seconds(query.at - first);
    ++track.queries;
    const auto decoded = protocol::decode_query(query.frame, reader.format);
    if (const auto* asked = std::get_if<protocol::Query>(&decoded)) {
      if (const auto gains = written_gains(asked->command)) track.gains = gains;
      const auto own = protocol::for_drive(track.id, *asked, reader.format);
      const auto* meant = std::get_if<protocol::Query>(&own);
      if (const auto order = order_of(meant != nullptr ? meant->command : asked->command, at_s)) {
        track.orders.push_back(*order);
      }
    }
    if (!exchange.reply) {
      ++track.unanswered;
      continue;
    }
    protocol::Frame frame = exchange.reply->frame;
    frame.id = own_id;
    const auto reply = protocol::decode_reply(frame, reader.format);
    const auto* content = std::get_if<protocol::ReplyFrame>(&reply);
    if (const auto* pid =
            content != nullptr ? std::get_if<protocol::Pid>(&content->reply) : nullptr) {
      track.gains = pid->gains;
    }
    if (const auto* state_1 =
            content != nullptr ? std::get_if<protocol::State1>(&content->reply) : nullptr) {
      voltages_V += state_1->voltage_V;
      ++voltages;
    }
    const auto* state =
        content != nullptr ? std::get_if<protocol::State2>(&content->reply) : nullptr;
    if (state == nullptr) continue;
    TrackSample sample{at_s, state->iq_A, state->speed_dps * kDeg, 0};
    sample.angle_rad = unwrapper.angle_rad(sample, state->encoder_counts);
    if (!track.samples.empty() && sample.time_s <= track.samples.back().time_s) continue;
    track.samples.push_back(sample);
  }
  track.median_step_s = median_step_s(track.samples);
  if (voltages > 0) track.supply_V = voltages_V / voltages;
}

}  // namespace

ServoConfig read_as(int id, const std::optional<Guess>& guess, const TrackOptions& options) {
  FirmwareRequest firmware;
  firmware.generation = options.generation;
  if (guess && !options.generation) {
    firmware.generation = generation_name(guess->nearest);
    for (const QuirkOption& one : guess->quirks) firmware.quirks.emplace(one.key, one.value);
  }
  if (guess && !guess->encoder_span.empty()) {
    firmware.quirks.emplace("encoder_span", guess->encoder_span);
  }
  Overrides asked;
  asked.motor = options.base.name;
  const bool serial = guess && guess->framing == protocol::Framing::kSerial;
  asked.buses.push_back(
      {.interface = serial ? "rs485:/log" : "log", .ids = std::vector{id}, .firmware = firmware});
  const auto find = [&options](const std::string& /*motor*/) { return options.base; };
  return default_config(asked, find).front().servos.front();
}

std::vector<Stretch> stretches(const Track& track) {
  std::vector<Stretch> found;
  std::size_t first = 0;
  for (std::size_t n = 1; n <= track.samples.size(); ++n) {
    const bool gap =
        n == track.samples.size() ||
        track.samples[n].time_s - track.samples[n - 1].time_s > kGapSteps * track.median_step_s;
    if (!gap) continue;
    found.push_back({first, n});
    first = n;
  }
  return found;
}

std::vector<HeldOrder> held_orders(const Track& track, Follows what) {
  const std::vector<TrackOrder>& orders = track.orders;
  // For each order the first after it that is another.
  std::vector<std::size_t> other(orders.size(), orders.size());
  for (std::size_t n = orders.size(); n-- > 1;) {
    const TrackOrder& a = orders[n - 1];
    const TrackOrder& b = orders[n];
    const bool same = a.what == b.what && a.value == b.value && b.is_absolute;
    other[n - 1] = same ? other[n] : n;
  }
  std::vector<HeldOrder> found;
  for (const Stretch& stretch : stretches(track)) {
    std::size_t n = stretch.first;
    while (n < stretch.last) {
      const auto next =
          std::ranges::upper_bound(orders, track.samples[n].time_s, {}, &TrackOrder::time_s);
      if (next == orders.begin()) {
        ++n;
        continue;
      }
      const auto place = static_cast<std::size_t>(next - orders.begin()) - 1;
      const TrackOrder& order = orders[place];
      const double until_s = other[place] == orders.size() ? std::numeric_limits<double>::infinity()
                                                           : orders[other[place]].time_s;
      const std::size_t first = n;
      while (n < stretch.last && track.samples[n].time_s < until_s) ++n;
      if (order.what == what && order.is_absolute) found.push_back({&order, first, n});
      if (n == first) ++n;
    }
  }
  return found;
}

std::vector<Track> read_tracks(std::string_view log, const TrackOptions& options) {
  Guesser guesser({});
  each_line(log, [&](std::string_view line) { guesser.take(line); });
  if (guesser.frames() == 0) {
    throw std::invalid_argument("nothing in it is a frame of candump; " + guesser.first_problem());
  }
  guesser.finish();
  std::vector<Track> tracks;
  const auto logged = frames_of(log);
  for (const auto& [wire, bus] : guesser.buses()) {
    const auto frames = logged.find(wire.first);
    if (frames == logged.end()) continue;
    for (const auto& [id, drive] : bus.drives) {
      if (options.id.value_or(id) != id || id == 0) continue;
      Track track;
      track.interface = wire.first;
      track.id = id;
      track.guess = guess_of(drive.evidence());
      track.servo = read_as(id, track.guess, options);
      BusConfig alone;
      alone.servos.push_back(track.servo);
      read_samples(pair_log(frames->second, alone), frames->second.front().timed.at, track);
      if (track.samples.size() >= kFewestSamples) tracks.push_back(std::move(track));
    }
  }
  return tracks;
}

void append(Track& track, const Track& more) {
  const double last_s = track.samples.empty() ? 0 : track.samples.back().time_s;
  const double orders_s = track.orders.empty() ? 0 : track.orders.back().time_s;
  const double shift_s = std::max(last_s, orders_s) + kBetweenLogs_s;
  for (TrackSample sample : more.samples) {
    sample.time_s += shift_s;
    track.samples.push_back(sample);
  }
  // What it followed between the logs is unknown.
  const double last_order_s = track.orders.empty() ? last_s : track.orders.back().time_s;
  track.orders.push_back({.time_s = std::clamp(last_order_s, last_s, shift_s)});
  for (TrackOrder order : more.orders) {
    order.time_s += shift_s;
    track.orders.push_back(order);
  }
  if (more.gains) track.gains = more.gains;
  track.queries += more.queries;
  track.unanswered += more.unanswered;
  track.median_step_s = median_step_s(track.samples);
  if (track.supply_V == 0) track.supply_V = more.supply_V;
}

}  // namespace lk::emulator
