#pragma once

#include <cstdint>

#include "emulator/core/bus_config.hpp"
#include "protocol/commands.hpp"

namespace lk::emulator {

/// A commanded position: an angle from a zero position. Both are integers, the angle in the unit of
/// the wire, so increments add up without rounding.
struct CommandedPosition {
  std::int64_t zero_counts = 0;  // encoder position from which the angle counts
  std::int64_t angle_cdeg = 0;

  friend bool operator==(const CommandedPosition&, const CommandedPosition&) = default;
};

/// Returns the bits of the encoder field of replies: at most 16, the upper ones of the encoder.
int wire_bits(const model::EncoderParams& encoder);

/// Rotor turns that the encoder field spans: 1, or the gear ratio.
double encoder_turns(const Profile& profile, const Quirks& quirks);

/// Angles of the rotor encoder on the wire: encoder field, single-turn and multi-turn angle, each
/// with its own zero. "Position" is the unwrapped count of the rotor encoder (model::Telemetry).
///
/// All angles are rotor angles, clockwise positive, also on geared drives. The single-turn angle
/// covers the *circle*: one rotor turn. If 0x94 has 32 bits for it and the encoder field spans an
/// output turn, the circle is that turn, in degrees of the rotor.
class ShaftAngles {
 public:
  explicit ShaftAngles(const Profile& profile, const Quirks& quirks = {});

  /// Encoder position, clockwise positive, even if the encoder is mounted to count the other way.
  std::int64_t position(const model::Telemetry& telemetry) const {
    return sensor_.direction * telemetry.encoder_position;
  }

  /// Largest value of the encoder field.
  std::uint16_t max_wire_count() const { return static_cast<std::uint16_t>(wire_counts_ - 1); }
  /// Raw value of the encoder on the wire.
  std::uint16_t raw(std::int64_t position) const;
  /// Encoder field: raw value − offset, modulo the number of wire counts.
  std::uint16_t encoder(std::int64_t position, std::uint16_t offset) const;
  /// Position within a rotor turn, all bits of the encoder, from the encoder's zero or the offset.
  std::uint32_t in_full(std::int64_t position, bool from_offset) const;
  /// Circle in 0.01°, one more than the largest single-turn angle: 36000, or 36000·gear_ratio.
  std::uint32_t circle_cdeg() const { return circle_cdeg_; }
  /// Single-turn angle, 0..circle_cdeg() − 1, from the single-turn zero.
  std::uint32_t single_turn_cdeg(std::int64_t position) const;
  /// Multi-turn angle, from the multi-turn zero.
  std::int64_t multi_turn_cdeg(std::int64_t position) const;
  /// Multi-turn angle of a position in rad (model::Position); not rounded.
  double multi_turn_deg(double theta) const;

  /// Applies an encoder offset, in wire counts. This also sets the single-turn zero.
  void set_offset(std::uint16_t offset);
  /// Loses the turn count: the multi-turn angle restarts from the position within the encoder's
  /// span, relative to the single-turn zero and wrapped as Quirks::boot_wrap says.
  void forget_turns(std::int64_t position);
  /// Adds `turns` rotor turns to the multi-turn angle.
  void miscount_turns(int turns) { multi_zero_ -= turns * counts_; }
  /// Makes this position the zero of the single-turn and of the multi-turn angle.
  void clear(std::int64_t position);
  /// Shifts the multi-turn angle so that it is `angle_cdeg` at this position.
  void set_multi_turn(std::int64_t position, std::int64_t angle_cdeg);

  CommandedPosition at(std::int64_t position) const { return {position, 0}; }
  CommandedPosition multi_turn_target(std::int64_t target_cdeg) const;
  /// Pre: `target_cdeg` < circle_cdeg(). Next position in the direction of travel with this
  /// single-turn angle. A shaft slightly past the target has arrived, so that neither encoder noise
  /// nor the control error at rest causes a full turn.
  CommandedPosition single_turn_target(std::int64_t position, bool clockwise,
                                       std::uint32_t target_cdeg) const;

  /// Commanded position in rad, for model::Position.
  double theta(const CommandedPosition& commanded) const;
  /// Rotor angle in rad (model::DriveInit::theta_m) that is `angle_deg` from encoder field 0. It
  /// does not depend on the dialect.
  double theta_m_at(double angle_deg) const;

 private:
  /// Pre: counts ≥ 0.
  std::int64_t rounded_cdeg(std::int64_t counts) const {
    return (counts * protocol::kTurn_cdeg + counts_ / 2) / counts_;
  }

  std::int64_t counts_;         // of the rotor encoder, per rotor turn
  std::int64_t wire_counts_;    // of the encoder field, per turn that it spans
  double counts_per_wire_lsb_;  // rotor counts
  model::EncoderParams sensor_;
  std::int64_t circle_counts_;  // counts of the rotor encoder in the circle
  std::uint32_t circle_cdeg_;
  std::int64_t wrap_counts_;       // the multi-turn angle starts within ± half of this
  std::int64_t encoder_zero_ = 0;  // position of encoder field 0, in the field's first turn
  std::int64_t single_zero_ = 0;   // 0..circle_counts_ − 1
  std::int64_t multi_zero_ = 0;
  std::int64_t multi_zero_cdeg_ = 0;  // multi-turn angle at multi_zero_; counts would round it
};

}  // namespace lk::emulator
