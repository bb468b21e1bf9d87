#pragma once

#include <cstdint>

#include "emulator/core/bus_config.hpp"
#include "protocol/commands.hpp"

namespace lk::emulator {

/// A commanded position: an angle from a place on the shaft. Kept as the integers it was commanded
/// in, so that increments add up without rounding.
struct CommandedPosition {
  std::int64_t zero_counts = 0;  // encoder position that the angle counts from
  std::int64_t angle_cdeg = 0;

  friend bool operator==(const CommandedPosition&, const CommandedPosition&) = default;
};

/// Rotor turns that the encoder field spans: 1, or the gear ratio.
double encoder_turns(const Profile& profile, const Quirks& quirks);

/// What the wire makes of the rotor encoder: encoder field, single-turn and multi-turn angle, each
/// with its own zero. "Position" is the unwrapped count of the rotor encoder (model::Telemetry).
///
/// All angles are rotor angles, clockwise positive; on geared drives too. The single-turn angle
/// covers the *circle*: one turn of the rotor, or, where 0x94 has the 32 bits for it and the
/// encoder field spans a turn of the output, that turn, in degrees of the rotor.
class ShaftAngles {
 public:
  explicit ShaftAngles(const Profile& profile, const Quirks& quirks = {});

  /// Counts clockwise, also where the encoder is mounted to count the other way.
  std::int64_t position(const model::Telemetry& telemetry) const {
    return sensor_.direction * telemetry.encoder_position;
  }

  /// The encoder field has 0..max_wire_count().
  std::uint16_t max_wire_count() const { return static_cast<std::uint16_t>(wire_counts_ - 1); }
  /// The encoder's own value, as the wire shows it.
  std::uint16_t raw(std::int64_t position) const;
  /// (raw − offset) mod turn.
  std::uint16_t encoder(std::int64_t position, std::uint16_t offset) const;
  /// The same with every bit that the encoder has: from its zero, or from the offset.
  std::uint32_t in_full(std::int64_t position, bool from_offset) const;
  /// One more than the largest single-turn angle: 36000, or 36000·gear_ratio.
  std::uint32_t circle_cdeg() const { return circle_cdeg_; }
  /// 0..circle_cdeg() − 1, from the single-turn zero.
  std::uint32_t single_turn_cdeg(std::int64_t position) const;
  /// From the multi-turn zero.
  std::int64_t multi_turn_cdeg(std::int64_t position) const;
  /// The multi-turn angle of a position in rad, as model::Position has it; not rounded.
  double multi_turn_deg(double theta) const;

  /// The encoder offset is in force from now on: the single-turn zero lies there.
  void set_offset(std::uint16_t offset);
  /// The turn count is lost: the multi-turn angle continues from where on the encoder's span the
  /// shaft stands, counted from the single-turn zero and wrapped as Quirks::boot_wrap says.
  void forget_turns(std::int64_t position);
  /// The multi-turn angle is off by so many turns of the rotor from now on.
  void miscount_turns(int turns) { multi_zero_ -= turns * counts_; }
  /// The present position becomes zero of the single- and the multi-turn angle.
  void clear(std::int64_t position);
  /// The present position has the multi-turn angle `angle_cdeg` from now on; nothing else changes.
  void set_multi_turn(std::int64_t position, std::int64_t angle_cdeg);

  CommandedPosition at(std::int64_t position) const { return {position, 0}; }
  CommandedPosition multi_turn_target(std::int64_t target_cdeg) const;
  /// The next place in the direction of travel where the single-turn angle is `target_cdeg`, below
  /// circle_cdeg(). A little behind counts as arrived: no full turn for the noise of the encoder,
  /// nor for where the position loop lets a shaft rest.
  CommandedPosition single_turn_target(std::int64_t position, bool clockwise,
                                       std::uint32_t target_cdeg) const;

  /// rad, what model::Position wants.
  double theta(const CommandedPosition& commanded) const;
  /// The shaft angle (model::DriveInit::theta_m) that is `angle_deg` from where the encoder field
  /// is 0. The same for all dialects: the circle plays no part in it.
  double theta_m_at(double angle_deg) const;

 private:
  /// Of counts ≥ 0.
  std::int64_t rounded_cdeg(std::int64_t counts) const {
    return (counts * protocol::kTurn_cdeg + counts_ / 2) / counts_;
  }

  std::int64_t counts_;         // of the rotor encoder, per rotor turn
  std::int64_t wire_counts_;    // of the encoder field, per turn that it spans
  double counts_per_wire_lsb_;  // rotor counts
  model::EncoderParams sensor_;
  std::int64_t circle_counts_;  // of the rotor encoder
  std::uint32_t circle_cdeg_;
  std::int64_t wrap_counts_;       // the multi-turn angle starts within half of this to either side
  std::int64_t encoder_zero_ = 0;  // in the first turn that the encoder field spans
  std::int64_t single_zero_ = 0;   // 0..circle_counts_ − 1
  std::int64_t multi_zero_ = 0;
  std::int64_t multi_zero_cdeg_ = 0;  // the multi-turn angle there, exact where counts are not
};

}  // namespace lk::emulator
