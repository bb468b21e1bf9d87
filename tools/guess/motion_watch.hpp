#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/sim_time.hpp"
#include "tools/guess/evidence.hpp"

namespace lk::emulator {

/// Conclusion from changes of the encoder field and of 0x92.
struct SeenTurn {
  EncoderSpan span = EncoderSpan::kRotorTurn;
  double counts = 0;  // of the encoder field in this turn
};

/// Finds the width of a drive's encoder field, and whether it spans a turn of the rotor or of the
/// output. Uses bounded memory.
class EncoderWatch {
 public:
  /// Processes the encoder field of a reply; `speed_dps` if the reply has it.
  void field(std::uint16_t counts, std::optional<int> speed_dps, std::optional<SimTime> at);
  /// Processes a reply to 0x92. Returns the turn that the encoder field spans, if the changes of
  /// the field and of the angle in 0x92 show it.
  std::optional<SeenTurn> angle(std::int64_t angle_cdeg, std::optional<SimTime> at);

  /// Returns the largest value of the field; empty if no reply had it.
  std::optional<std::uint16_t> largest() const { return largest_; }
  /// Returns the last value of the field.
  std::optional<std::uint16_t> last() const {
    return last_ ? std::optional(last_->counts) : std::nullopt;
  }
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

/// Finds traits that only motion or angle of a drive show. Ignores frames without time stamps.
class MotionWatch {
 public:
  void query(const Sighting& query);
  void reply(const Sighting& reply, Evidence& evidence);

 private:
  void state_2(const Sighting& reply, Evidence& evidence);
  void angle(const Sighting& reply, Evidence& evidence);

  // For Trait::kRunResumes: a speed command, then 0x81, then 0x88.
  enum class Run : std::uint8_t { kNone, kAsked, kTurning, kStopping, kResting, kRunSent, kStayed };
  Run run_ = Run::kNone;
  double speed_dps_ = 0;
  SimTime since_{0};   // time of the speed command
  SimTime rise_{0};    // time from the command to turning
  SimTime run_at_{0};  // time of 0x88
  Sighting stayed_;
  // For Trait::kSpeedLimit: the limit of the last 0xA2, the time since the limit is the same. Also
  // the number of replies since then and of replies beyond the limit.
  int limit_lsb_ = 0;
  SimTime limited_since_{0};
  std::uint64_t held_ = 0;
  std::uint64_t beyond_ = 0;
  // For Trait::kClearAngle: time and angle of the last reply before 0x95, time and angle in 0x95.
  std::optional<std::pair<SimTime, std::int64_t>> angle_cdeg_;
  std::optional<std::pair<SimTime, std::int64_t>> cleared_to_cdeg_;
};

}  // namespace lk::emulator
