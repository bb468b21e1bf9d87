#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "emulator/core/language.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Event after which a host has to read the angle of the drive before it moves the drive.
enum class AngleEvent : std::uint8_t {
  kStart,
  kRestart,
  kOff,      // 0x80
  kStop,     // 0x81
  kError,    // a protection has tripped
  kFault,    // an injected fault has begun on this drive
  kSilence,  // no frame of a host for more than Unasked::kPeriods of its own periods
};

/// "the start", "an error".
const BilingualText& event_text(AngleEvent event);

/// Powered motion of a drive without its host knowing the angle.
struct UnaskedMotion {
  std::uint64_t number = 0;  // of this drive, from 1 on; 0: none so far
  bool over = true;
  AngleEvent event = AngleEvent::kStart;
  bool unread = false;    // no angle received since the event
  bool turns = false;     // by a speed, torque or power command
  bool answered = false;  // the host has received an angle since the beginning
  bool silent = false;    // the drive turns on while the host is silent
  bool to_zero = false;   // first target since the event: exactly 0, and far
  bool wrapped = false;   // target 2^32 · 0.01° from the shaft, within one turn
  SimTime from{0};        // beginning
  protocol::Frame frame;  // command that started the motion
  double target_deg = 0;  // of a multi-turn position command
  double shaft_deg = 0;   // multi-turn angle at the beginning
  double deg = 0;         // largest distance of the output from the beginning
  double dps = 0;         // peak speed of the output
  double J = 0;           // largest mechanical work of the motor
};

/// Finds unasked motions of a drive. During an unasked motion it samples the motor every kPeriod,
/// or every kLongPeriod if the drive turns on after its host has received an angle. Otherwise it
/// runs at queries and replies, and during a speed, torque or power command once in kPeriods
/// periods of the host.
class Unasked {
 public:
  static constexpr int kPeriods = 5;
  static constexpr SimTime kPeriod = std::chrono::milliseconds(1);
  static constexpr SimTime kLongPeriod = std::chrono::milliseconds(100);
  /// Shorter motions of the output are harmless.
  static constexpr double kFar_deg = 5;

  void on_event(AngleEvent event);
  /// Call for each frame of a host that addresses the drive, before the drive processes it.
  /// `replayed`: it waited in the host's queue, so its time is not that of the host.
  void on_query(SimTime at, bool replayed);
  /// Call after `handle`. `before`: set point before the query.
  void on_executed(SimTime at, const Servo& servo, const Query& query, const protocol::Frame& frame,
                   const model::Setpoint& before, const Lane& lane);
  /// Call for each reply that leaves the firmware. `byte`: its DATA[0].
  void on_answer(const Reply& reply, std::uint8_t byte);
  /// Call for each frame of the drive that hosts have received.
  void on_received(const protocol::Frame& frame);
  /// Returns the time of the next `step` unless it is already scheduled. The caller schedules it.
  std::optional<SimTime> take_next_step(SimTime now, const Lane& lane);
  void step(SimTime now, const Servo& servo, const Lane& lane);

  const UnaskedMotion& last() const { return motion_; }
  /// The motion with the largest distance so far.
  const UnaskedMotion& worst() const { return worst_; }
  // Largest values of all unasked motions.
  double deg() const { return worst_.deg; }
  double dps() const { return dps_; }
  double J() const { return J_; }

 private:
  /// The period of a host is the largest of its last kGaps gaps (assumed), as hosts may send
  /// bursts. A host with fewer gaps has no period.
  static constexpr std::size_t kGaps = 16;
  // A motion ends when the output has been slower than kRest_dps for kRest (assumed).
  static constexpr double kRest_dps = 1;
  static constexpr SimTime kRest = std::chrono::milliseconds(100);

  std::optional<SimTime> silence_limit() const;
  void begin(const UnaskedMotion& motion, const Lane& lane);
  bool continues(const model::Setpoint& before, const model::Setpoint& now, const Lane& lane) const;
  bool is_old(const model::Setpoint& before, const model::Setpoint& now, double gear) const;

  AngleEvent event_ = AngleEvent::kStart;
  bool known_ = false;                 // an angle sampled after the event has been received
  bool first_target_ = true;           // no position command since the event
  bool tripped_ = false;               // Servo::tripped at the last query
  bool scheduled_ = false;             // a step is pending
  std::bitset<256> sampled_;           // DATA[0] of replies with an angle since the event
  std::optional<SimTime> last_query_;  // last frame of a host
  std::array<SimTime, kGaps> gaps_{};  // a ring
  std::size_t gap_count_ = 0;
  UnaskedMotion motion_;  // the last one
  double from_rad_ = 0;   // output at the beginning of `motion_`
  double work_J_ = 0;     // since the beginning
  SimTime sampled_at_{0};
  SimTime moved_at_{0};  // last sample that was not at rest
  UnaskedMotion worst_;
  double dps_ = 0, J_ = 0;
};

}  // namespace lk::emulator
