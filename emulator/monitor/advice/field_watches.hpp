#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/monitor/advice/advice.hpp"
#include "emulator/monitor/advice/watch_input.hpp"

namespace lk::emulator {

/// Finds a field that the drive clamps or refuses (ranges: docs/reference/protocol.md).
std::optional<Finding> beyond_range(const DecodedQuery& query, const KnownDrive& drive);

/// Watches settings that are written (0x42), saved (0x44) and in force after a restart (0x07). Uses
/// only wire traffic, and counts writes that a drive acknowledges.
class SettingWatch {
 public:
  /// Processes a frame of 8 bytes. The state in `drive` may be older than the frame.
  std::vector<Finding> on_query(const protocol::Payload& data, const KnownDrive& drive);
  void on_reply(const protocol::Payload& data);

 private:
  bool pending_ = false;             // acknowledged but not saved
  std::uint32_t pending_start_ = 0;  // start of the drive with that write
  std::uint32_t start_ = 1;          // of the drive, at its last frame
};

/// Finds a parameter number of one table used with a command of the other table.
std::optional<Finding> mixed_up_tables(const protocol::Payload& data);

/// Detects repeated writes to ROM, which wear it.
class RomWatch {
 public:
  /// A person writes a few times during setup; ten of one kind come from a program (assumed).
  static constexpr std::size_t kWrites = 10;
  /// No advice if the memory lasts longer than this at the rate of the ten writes (assumed).
  static constexpr SimTime kLongLife = std::chrono::hours(365 * 24);

  std::optional<Finding> on_query(const DecodedQuery& query, const KnownDrive& drive);

 private:
  /// Times of the last ten writes of one parameter, in a ring.
  struct Writes {
    std::array<SimTime, kWrites> at{};
    std::size_t count = 0;
  };
  Writes gains_;
  Writes offset_;
};

/// Detects a calibration (0x18) with a load on the shaft.
class CalibrationWatch {
 public:
  /// Share of the rated torque, averaged over the run. Friction cancels out, as its sign changes
  /// when the shaft turns back.
  static constexpr double kShare = 0.2;

  /// Returns true if the drive must be looked at every time.
  bool runs() const { return looks_ > 0; }
  std::optional<Finding> observe(const KnownDrive& drive);

 private:
  double sum_Nm_ = 0;
  int looks_ = 0;
};

/// Detects positions that are sent as speeds. Such a host changes the value when the shaft reaches
/// it, or starts a path at the shaft's position.
class SpeedWatch {
 public:
  static constexpr double kLeast_dps = 5;                           // assumed
  static constexpr SimTime kHeld = std::chrono::milliseconds(100);  // assumed
  static constexpr int kArrivals = 3;                               // assumed: twice may be chance
  static constexpr double kNear_deg = 2;       // plus the travel within kReaction_s (assumed)
  static constexpr double kReaction_s = 0.02;  // of a host that reads at 50 Hz (assumed)
  static constexpr SimTime kJustRead = std::chrono::seconds(1);  // assumed
  static constexpr double kStart_deg = 0.3;  // includes the first step of a path (assumed)
  static constexpr double kStep_dps = 5;     // per step of a path (assumed)
  static constexpr int kSteps = 10;          // assumed

  std::optional<Finding> on_query(const DecodedQuery& query, const KnownDrive& drive);

 private:
  bool starts_at_shaft(double value, SimTime at, const KnownDrive& drive) const;
  std::optional<Finding> follow_path(double value);
  std::optional<Finding> leave_target(double value, SimTime at, const KnownDrive& drive);

  std::optional<SimTime> angle_read_;
  std::optional<double> value_;  // in force
  SimTime since_{0};
  int arrivals_ = 0;
  double arrived_dps_ = 0;    // size of the last value that arrived
  std::optional<int> steps_;  // of a path that began at the shaft
};

}  // namespace lk::emulator
