#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "tools/guess/evidence.hpp"

namespace lk::emulator {

/// What only shows in how a drive moves, or in what its angle becomes. Needs time stamps.
class MotionWatch {
 public:
  void query(const Sighting& query);
  void reply(const Sighting& reply, Evidence& evidence);

 private:
  void state_2(const Sighting& reply, Evidence& evidence);
  void angle(const Sighting& reply, Evidence& evidence);
  void forget_run();

  // 0x88 after 0x81: how far a speed command has got.
  enum class Run : std::uint8_t { kNone, kAsked, kTurning, kStopping, kResting, kTold, kStayed };
  Run run_ = Run::kNone;
  double speed_dps_ = 0;
  SimTime since_{0};  // the command
  SimTime rise_{0};   // how long it took to turn
  SimTime told_{0};   // 0x88
  Sighting stayed_;
  // 0xA2 with a limit: since when, and replies beyond it.
  int limit_lsb_ = 0;
  SimTime limited_since_{0};
  std::uint64_t held_ = 0;
  std::uint64_t beyond_ = 0;
  // 0x95: the angle before, and what was sent.
  std::optional<std::pair<SimTime, std::int64_t>> angle_cdeg_;
  std::optional<std::pair<SimTime, std::int64_t>> cleared_to_cdeg_;
};

}  // namespace lk::emulator
