#pragma once

#include <string>
#include <vector>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

class Line;
struct Signal;

/// Significant decimal digits that represent each value exactly.
inline constexpr int kExactDigits = 17;

/// Drives, signals and rate that a client wants sampled.
struct TelemetryRequest {
  Line* line = nullptr;
  std::vector<int> ids;
  std::vector<const Signal*> signals;       // of each drive
  std::vector<const Signal*> body_signals;  // one value each per sample
  double values() const {                   // per sample
    return static_cast<double>(ids.size() * signals.size() + body_signals.size());
  }
  double rate_Hz = 100;
  SimTime period{0};
  // 1: each message is one sample. Above 1: each message is a list of up to this number of samples,
  // which costs less.
  int samples_per_message = 1;
  int digits = kExactDigits;  // of values
};

inline constexpr double kSlowestTelemetry_Hz = 0.1;
inline constexpr double kFastestTelemetry_Hz = 20'000;
inline constexpr int kMaxSamplesPerMessage = 1000;
/// Limit of values per second of simulated time in one stream.
inline constexpr double kMaxTelemetry = 200'000;

}  // namespace lk::emulator
