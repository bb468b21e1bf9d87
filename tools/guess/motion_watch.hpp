#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "tools/guess/evidence.hpp"

namespace lk::emulator {

/// Finds traits that show only in the motion or the angle of a drive. Needs time stamps.
class MotionWatch {
 public:
  void query(const Sighting& query);
  void reply(const Sighting& reply, Evidence& evidence);

 private:
  void state_2(const Sighting& reply, Evidence& evidence);
  void angle(const Sighting& reply, Evidence& evidence);
  void forget_run();

  // 0x88 after 0x81: progress of a speed command.
  enum class Run : std::uint8_t { kNone, kAsked, kTurning, kStopping, kResting, kTold, kStayed };
  Run run_ = Run::kNone;
  double speed_dps_ = 0;
  SimTime since_{0};  // time of the command
  SimTime rise_{0};   // time from the command to turning
  SimTime told_{0};   // time of 0x88
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
