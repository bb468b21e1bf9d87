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

/// What hung on the log's shaft, at the output. It was not measured; this is what start, stop and
/// what comes after them ask for together (docs/fidelity.md): a part that turns with the gear, and
/// one behind a spring, as a finger is behind its linkage.
struct JointLoad {
  double rigid_kg_m2 = 0.0023;
  double sprung_kg_m2 = 0.0030;  // 0: none, and the gear is the profile's
  double sprung_Hz = 12.5;       // with the rotor held
  double damping = 0.045;        // share of the critical
};
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

/// The host asks up to `jitter_us` sooner or later than every 12 ms.
JointLog move_joint(std::uint64_t seed, int jitter_us = 0, const JointLoad& load = {});
/// How uneven the log's host was, assumed; that it was follows from the log: what is sampled every
/// 12 ms sharp cannot tell 28 ripples a turn from 24.4.
inline constexpr int kJitter_us = 2000;
/// The moves of the seeds 1 to kMoves, sampled as unevenly.
const std::vector<JointLog>& joint_moves();

}  // namespace lk::test
