#pragma once

/// @file All that logs tell of one drive, as rows of one table: what is printed, written to a motor
/// file, compared and drawn comes from it.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/identify/balance_fit.hpp"
#include "tools/identify/estimate.hpp"
#include "tools/identify/position_loop_fit.hpp"
#include "tools/identify/speed_loop_fit.hpp"
#include "tools/identify/track.hpp"
#include "tools/identify/voltage_fit.hpp"

namespace lk::emulator {

struct IdentifiedDrive;

/// What a log may tell. In amperes: a log has no torques.
struct Quantity {
  std::string_view key;    // in the file; ends with its unit
  std::string_view label;  // for people
  std::string_view unit;
  std::string_view how;         // it is found
  std::string_view experiment;  // that tells it where this log does not
  /// What the fits say; nothing: the log has nothing about it.
  std::optional<Estimate> (*found)(const IdentifiedDrive& drive);
  /// What a motor file says, with nothing on the shaft; 0: nothing.
  double (*base)(const ServoConfig& servo);
  bool is_of_motor = true;  // false: of the supply or of the load, which may be others next time
};

struct IdentifiedValue {
  const Quantity* quantity = nullptr;
  std::optional<Estimate> estimate;  // nothing: the log has nothing about it
  double base = 0;                   // what the motor file has; 0: nothing
};

struct IdentifiedDrive {
  Track track;
  std::optional<BalanceFit> balance;
  SpeedLoopFit speed_loop;
  std::optional<PositionLoopFit> position_loop;
  std::optional<VoltageFit> voltage;
  std::vector<IdentifiedValue> values;  // one for each quantity, in the order of quantities()
  /// The strongest cogging that offsets of the current sensors do not explain, and what is at
  /// pole_pairs per turn, where they are felt. Of `balance`.
  const Cogging* cogging() const;
  const Cogging* offset_ripple() const;
};

/// In the order in which they are shown.
std::span<const Quantity> quantities();
const Quantity* find_identified(std::string_view key);

IdentifiedDrive identify(Track track);

}  // namespace lk::emulator
