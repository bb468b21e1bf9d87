#pragma once

/// @file What a log tells of one drive over time: what it was asked for, and what it said of its
/// shaft.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "protocol/parameters.hpp"
#include "tools/guess/guess.hpp"

namespace lk::emulator {

/// A reply with the second state, at the rotor.
struct TrackSample {
  double time_s = 0;  // of the query: the drive answers with what it is then
  double iq_A = 0;
  double speed_rad_s = 0;
  double angle_rad = 0;  // over all turns; goes on across gaps, in steps of a turn perhaps
};

/// What the drive follows from an instant on.
enum class Follows : std::uint8_t { kNothing, kTorque, kSpeed, kPosition };
struct TrackOrder {
  double time_s = 0;
  Follows what = Follows::kNothing;
  double value = 0;         // A, rad/s, rad of the multi-turn angle
  double limit_rad_s = 0;   // of the speed on the way to a position; 0: none said
  bool is_absolute = true;  // false: an increment, or a place on the circle
};

struct Track {
  std::string interface;
  int id = 0;
  Guess guess;
  ServoConfig servo;  // that the log was read as
  std::vector<TrackSample> samples;
  std::vector<TrackOrder> orders;
  std::optional<protocol::PidGains> gains;  // that the drive had, by the last that the log says
  double supply_V = 0;                      // the mean of what it reported; 0: nothing
  std::uint64_t queries = 0;
  std::uint64_t unanswered = 0;
  double median_step_s = 0;  // between samples
};

/// Where samples follow each other without a gap: [first, last).
struct Stretch {
  std::size_t first = 0;
  std::size_t last = 0;
};
/// Gaps are longer than five usual steps (assumed).
std::vector<Stretch> stretches(const Track& track);

/// Samples [first, last) that follow one order.
struct HeldOrder {
  const TrackOrder* order;
  std::size_t first, last;
};
/// The parts of the log that follow absolute orders of a kind, an order that is said again being
/// the same.
std::vector<HeldOrder> held_orders(const Track& track, Follows what);

/// Replies with the second state that a drive must have given to be looked at: ten seconds at 20 Hz
/// (assumed).
inline constexpr std::size_t kFewestSamples = 200;

/// How the frames are read.
struct TrackOptions {
  Profile base;                           // what is known of the motor: gear, series, encoder
  std::optional<std::string> generation;  // where it is known; else as the log shows
  std::optional<int> id;                  // this drive alone
};

/// The drive as a log shows it, on what is known of its motor; without a guess, of the generation
/// that was said, else the oldest. Throws std::invalid_argument.
ServoConfig read_as(int id, const std::optional<Guess>& guess, const TrackOptions& options);

/// The drives of a candump log that said enough of their shafts, by interface and ID. Throws
/// std::invalid_argument where nothing in it is a frame.
std::vector<Track> read_tracks(std::string_view log, const TrackOptions& options);

/// What another log says of the same drive, after a gap.
void append(Track& track, const Track& more);

}  // namespace lk::emulator
