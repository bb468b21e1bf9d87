#pragma once

/// @file The move of a log of three joints, made by an emulated drive: 0xA4 by −600° with a limit
/// of 573 dps, gains 100/100, 40/14, 50/50, 24 V, no ramps, sampled every 12 ms with 0x9C. The log
/// is a geared MG drive's with 14 pole pairs; docs/decisions/0003 tells of it.

#include <cstdint>
#include <vector>

namespace lk::test {

inline constexpr double kLimit_dps = 573;
inline constexpr std::size_t kTravelSamples = 140;  // 1.7 s: the move takes 1.1 s, then it settles
inline constexpr std::size_t kHoldSamples = 300;
inline constexpr std::uint64_t kMoves = 12;  // seeds from 1
/// At the output, assumed: the finger that hung on the log's shaft, so that the start fits.
inline constexpr double kArm_kg_m2 = 0.004;
/// Of a count of the reply, which spans a turn of the output, within the window of 1 ms.
inline constexpr double kJointSpeedStep_dps = 360.0 / 65536 / 1e-3;

struct JointSample {
  double speed_dps = 0;
  double iq_lsb = 0;       // of the legacy reply; the log's is the same to 0.01 %
  int error_counts = 0;    // of 65536 per output turn, from the target
  double rotor_turns = 0;  // by the encoder, from the target
};

struct JointLog {
  std::vector<JointSample> samples;
  std::size_t stop_begins = 0;  // first sample of the deceleration

  /// Samples `from` to `to` − 1 of one quantity.
  std::vector<double> pick(std::size_t from, std::size_t to, double JointSample::*field) const;
  /// Well after the start has settled and well before the stop.
  std::vector<double> cruise(double JointSample::*field) const {
    return pick(16, stop_begins - 4, field);
  }
  std::vector<double> hold(double JointSample::*field) const {
    return pick(kTravelSamples, samples.size(), field);
  }
};

/// What differs from the log's own move.
struct JointMove {
  double arm_kg_m2 = kArm_kg_m2;
  /// How much later or earlier than every 12 ms the host asks, at the most; a sampling that is even
  /// cannot tell 28 ripples a turn from 24.4.
  int jitter_us = 0;
};

JointLog move_joint(std::uint64_t seed, const JointMove& move = {});
/// The moves of the seeds 1 to kMoves.
const std::vector<JointLog>& joint_moves();

}  // namespace lk::test
