#pragma once

/// @file The move of a log of three joints, made by an emulated drive. 0xA4 by −600° with a limit
/// of 573 dps, gains 100/100, 40/14, 50/50, 24 V, no ramps, sampled every 12 ms with 0x9C. The log
/// is from a geared MG drive with 14 pole pairs; see docs/internals/decisions/0003.

#include <cstdint>
#include <vector>

#include "emulator/core/bus_config.hpp"

namespace lk::test {

inline constexpr double kLimit_dps = 573;
inline constexpr std::size_t kTravelSamples = 140;  // 1.7 s: the move takes 1.1 s, plus settling
inline constexpr std::size_t kHoldSamples = 300;
inline constexpr std::uint64_t kMoves = 12;  // seeds from 1

/// Load on the log's shaft, at the output. Not measured, but derived from start, stop and settling
/// together (docs/internals/fidelity.md). One part is fixed to the gear; the other is behind a
/// spring, like a finger behind its linkage.
struct JointLoad {
  double rigid_kg_m2 = 0.0023;
  double sprung_kg_m2 = 0.0032;  // 0: none, with the profile's gear
  double sprung_Hz = 12.5;       // with the rotor held
  double damping = 0.045;        // share of the critical damping
};
/// Speed of one count of the reply, which spans an output turn, within the window of 1 ms.
inline constexpr double kJointSpeedStep_dps = 360.0 / 65536 / 1e-3;

struct JointSample {
  double speed_dps = 0;
  double iq_lsb = 0;       // of the legacy reply; equals the log's to 0.01 %
  int error_counts = 0;    // of 65536 per output turn, from the target
  double rotor_turns = 0;  // by the encoder, from the target
};

struct JointLog {
  std::vector<JointSample> samples;
  std::size_t stop_begins = 0;  // first sample of the deceleration

  /// Returns samples `from` to `to` − 1 of one quantity.
  std::vector<double> pick(std::size_t from, std::size_t to, double JointSample::*field) const;
  /// Returns samples after the start has settled and before the stop.
  std::vector<double> cruise(double JointSample::*field) const {
    return pick(16, stop_begins - 4, field);
  }
  std::vector<double> hold(double JointSample::*field) const {
    return pick(kTravelSamples, samples.size(), field);
  }
};

/// The host queries every 12 ms ± `jitter_us`.
JointLog move_joint(std::uint64_t seed, int jitter_us = 0, const JointLoad& load = {},
                    emulator::Specimen specimen = emulator::Specimen::kNominal);
/// Follows a target that stays 70° ahead, so that the speed is the limit of 0xA4. The host changes
/// the limit from `from_dps` to `to_dps` in `samples` steps, as in the log's second half. Each seed
/// is one specimen.
JointLog track_joint(std::uint64_t seed, double from_dps, double to_dps, std::size_t samples);
/// Jitter of the log's host, assumed. The log proves jitter: with exactly 12 ms, 28 ripples a turn
/// could not be told from 24.4.
inline constexpr int kJitter_us = 2000;
/// Returns the moves of seeds 1 to kMoves, sampled with this jitter.
const std::vector<JointLog>& joint_moves();

}  // namespace lk::test
