#include "emulator/core/servo/shaft_angles.hpp"

#include <algorithm>
#include <cassert>
#include <numbers>

#include "model/control/motion_loops.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {
namespace {

using protocol::kTurn_cdeg;

constexpr int kMaxWireBits = 16;            // wider encoders show their top 16 bits
constexpr double kArrived_wire_counts = 2;  // docs/reference/protocol.md §4.3
/// Bound of the encoder noise in multiples of its rms: its peak is √12 (model/noise.hpp).
constexpr double kMaxNoise = 4;

/// Returns the largest distance, in counts, between the target and the encoder position of a shaft
/// that holds this target.
double arrived_counts(const model::EncoderParams& sensor, double counts, double wire_lsb_counts) {
  const double held = model::kHoldAngle + kMaxNoise * sensor.noise;
  // Plus one, because the control loop compares whole counts.
  const double held_counts = held / (2 * std::numbers::pi) * counts + 1;
  return std::max(kArrived_wire_counts * wire_lsb_counts, held_counts);
}

/// Returns a/b rounded towards −∞, unlike `/`.
std::int64_t floor_div(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0 ? 1 : 0); }
/// Returns the remainder in 0..b − 1, unlike `%`.
std::int64_t floor_mod(std::int64_t a, std::int64_t b) { return a % b + (a % b < 0 ? b : 0); }

}  // namespace

int wire_bits(const model::EncoderParams& encoder) { return std::min(encoder.bits, kMaxWireBits); }

double encoder_turns(const Profile& profile, const Quirks& quirks) {
  const EncoderSpan span = quirks.encoder_span.value_or(profile.encoder_span);
  return span == EncoderSpan::kOutputTurn ? profile.drive.mechanics.gear_ratio : 1.0;
}

ShaftAngles::ShaftAngles(const Profile& profile, const Quirks& quirks)
    : counts_(std::int64_t{1} << profile.drive.encoder.bits),
      wire_counts_(std::int64_t{1} << wire_bits(profile.drive.encoder)),
      sensor_(profile.drive.encoder) {
  const double span = encoder_turns(profile, quirks);
  counts_per_wire_lsb_ = static_cast<double>(counts_) * span / static_cast<double>(wire_counts_);
  const auto span_counts = protocol::rounded(span * static_cast<double>(counts_));
  const double circle_turns = quirks.dialect.wide_single_turn ? span : 1.0;
  circle_counts_ = protocol::rounded(circle_turns * static_cast<double>(counts_));
  circle_cdeg_ = static_cast<std::uint32_t>(protocol::rounded(circle_turns * kTurn_cdeg));
  // Uses the members above. NOLINTNEXTLINE(cppcoreguidelines-prefer-member-initializer)
  wrap_counts_ = quirks.boot_wrap == BootWrap::kHalfCircle ? span_counts : counts_;
}

std::uint16_t ShaftAngles::raw(std::int64_t position) const {
  const std::int64_t wire_position =
      protocol::rounded_down(static_cast<double>(position) / counts_per_wire_lsb_);
  return static_cast<std::uint16_t>(floor_mod(wire_position, wire_counts_));
}

std::uint16_t ShaftAngles::encoder(std::int64_t position, std::uint16_t offset) const {
  return static_cast<std::uint16_t>(
      floor_mod(std::int64_t{raw(position)} - std::int64_t{offset}, wire_counts_));
}

std::uint32_t ShaftAngles::in_full(std::int64_t position, bool from_offset) const {
  return static_cast<std::uint32_t>(
      floor_mod(position - (from_offset ? encoder_zero_ : 0), counts_));
}

std::uint32_t ShaftAngles::single_turn_cdeg(std::int64_t position) const {
  const std::int64_t in_circle = floor_mod(position - single_zero_, circle_counts_);
  // Angles in the last 0.005° of the circle round to the zero of the next circle.
  return static_cast<std::uint32_t>(rounded_cdeg(in_circle) % circle_cdeg_);
}

std::int64_t ShaftAngles::multi_turn_cdeg(std::int64_t position) const {
  const std::int64_t turns = floor_div(position - multi_zero_, counts_);
  const std::int64_t in_turn = floor_mod(position - multi_zero_, counts_);
  return multi_zero_cdeg_ + turns * kTurn_cdeg + rounded_cdeg(in_turn);
}

double ShaftAngles::multi_turn_deg(double theta) const {
  const double zero_turns = static_cast<double>(multi_zero_) / static_cast<double>(counts_);
  return 360 * (theta / (2 * std::numbers::pi) - zero_turns) +
         0.01 * static_cast<double>(multi_zero_cdeg_);
}

void ShaftAngles::set_offset(std::uint16_t offset) {
  encoder_zero_ = protocol::rounded(offset * counts_per_wire_lsb_);
  single_zero_ = encoder_zero_;
}

void ShaftAngles::forget_turns(std::int64_t position) {
  const std::int64_t in_wrap = floor_mod(position - single_zero_, wrap_counts_);
  // Compares rounded angles: an angle that reads as exactly half is not wrapped.
  const bool beyond_half = 2 * rounded_cdeg(in_wrap) > rounded_cdeg(wrap_counts_);
  const std::int64_t wrapped = beyond_half ? in_wrap - wrap_counts_ : in_wrap;
  multi_zero_ = position - wrapped;
  multi_zero_cdeg_ = 0;
}

void ShaftAngles::clear(std::int64_t position) {
  single_zero_ = position;
  set_multi_turn(position, 0);
}

void ShaftAngles::set_multi_turn(std::int64_t position, std::int64_t angle_cdeg) {
  multi_zero_ = position;
  multi_zero_cdeg_ = angle_cdeg;
}

CommandedPosition ShaftAngles::multi_turn_target(std::int64_t target_cdeg) const {
  return {multi_zero_, target_cdeg - multi_zero_cdeg_};
}

CommandedPosition ShaftAngles::single_turn_target(std::int64_t position, bool clockwise,
                                                  std::uint32_t target_cdeg) const {
  assert(target_cdeg < circle_cdeg_);
  const auto circle = static_cast<double>(circle_counts_);
  const double arrived =
      arrived_counts(sensor_, static_cast<double>(counts_), counts_per_wire_lsb_);
  const std::int64_t in_circle = floor_mod(position - single_zero_, circle_counts_);
  const double travel =
      target_cdeg * static_cast<double>(counts_) / kTurn_cdeg - static_cast<double>(in_circle);
  std::int64_t zero = position - in_circle;
  if (clockwise) {
    if (travel < -arrived) {
      zero += circle_counts_;
    } else if (travel >= circle - arrived) {
      zero -= circle_counts_;
    }
  } else {
    if (travel > arrived) {
      zero -= circle_counts_;
    } else if (travel <= arrived - circle) {
      zero += circle_counts_;
    }
  }
  return {zero, target_cdeg};
}

double ShaftAngles::theta(const CommandedPosition& commanded) const {
  const double turns = static_cast<double>(commanded.zero_counts) / static_cast<double>(counts_) +
                       static_cast<double>(commanded.angle_cdeg) / kTurn_cdeg;
  return 2 * std::numbers::pi * turns;
}

double ShaftAngles::theta_m_at(double angle_deg) const {
  // + 0.5: the angle is in the middle of a count, so that encoder noise does not change the count.
  const double turns =
      (static_cast<double>(encoder_zero_) + 0.5) / static_cast<double>(counts_) + angle_deg / 360.0;
  // The sensor shows direction·theta_m + offset.
  return 2 * std::numbers::pi * turns - sensor_.direction * sensor_.offset;
}

}  // namespace lk::emulator
