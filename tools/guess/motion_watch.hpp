#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/sim_time.hpp"
#include "tools/guess/evidence.hpp"

namespace lk::emulator {

/// Finds the width of a drive's encoder field, and which turn it spans. Its memory is bounded.
class EncoderWatch {
 public:
  /// Processes the encoder field of a reply; `speed_dps` if the reply has it.
  void field(std::uint16_t counts, std::optional<int> speed_dps, std::optional<SimTime> at);
  /// Processes a reply to 0x92. Returns the turn that the steps of the field and of 0x92 show.
  std::optional<EncoderSpan> angle(std::int64_t angle_cdeg, std::optional<SimTime> at);

  /// Returns the largest value of the field; empty if no reply had it.
  std::optional<std::uint16_t> largest() const { return largest_; }
  /// Returns the counts of the field per 360° of 0x92; empty if the shaft turned too little.
  std::optional<double> counts_per_turn() const;

 private:
  struct Field {
    std::uint16_t counts = 0;
    std::optional<int> speed_dps;
    std::optional<SimTime> at;
  };
  struct Place {
    double angle_cdeg = 0;
    int counts = 0;
  };

  std::optional<std::uint16_t> largest_;
  std::optional<Field> last_;
  std::optional<Place> from_;
  std::vector<double> per_turn_;
};

/// Finds traits that show only in the motion or the angle of a drive. Needs time stamps.
class MotionWatch {
 public:
  void query(const Sighting& query);
  void reply(const Sighting& reply, Evidence& evidence);

 private:
  void state_2(const Sighting& reply, Evidence& evidence);
  void angle(const Sighting& reply, Evidence& evidence);

  // 0x88 after 0x81: progress of a speed command.
  enum class Run : std::uint8_t { kNone, kAsked, kTurning, kStopping, kResting, kRunSent, kStayed };
  Run run_ = Run::kNone;
  double speed_dps_ = 0;
  SimTime since_{0};   // time of the command
  SimTime rise_{0};    // time from the command to turning
  SimTime run_at_{0};  // time of 0x88
  Sighting stayed_;
  // 0xA2 with a limit: its start, replies since then, and replies beyond the limit.
  int limit_lsb_ = 0;
  SimTime limited_since_{0};
  std::uint64_t held_ = 0;
  std::uint64_t beyond_ = 0;
  // 0x95: the angle before, and the angle sent.
  std::optional<std::pair<SimTime, std::int64_t>> angle_cdeg_;
  std::optional<std::pair<SimTime, std::int64_t>> cleared_to_cdeg_;
};

}  // namespace lk::emulator
