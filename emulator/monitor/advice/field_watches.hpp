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

/// Detects settings that are written (0x42) but not saved (0x44) before a restart (0x07), which
/// loses them. Only writes that a drive acknowledges count.
class SettingWatch {
 public:
  /// Processes a frame of 8 bytes. The state in `drive` may be older than the frame.
  std::vector<Finding> on_query(const protocol::Payload& data, const KnownDrive& drive);
  void on_reply(const protocol::Payload& data);

 private:
  bool pending_ = false;             // acknowledged but not saved
  std::uint32_t pending_start_ = 0;  // KnownDrive::starts at that write
  std::uint32_t start_ = 1;          // KnownDrive::starts at the last frame for the drive
};

/// Finds a parameter number (0xC0, 0xC1) used with 0x42, or a setting number (0x40, 0x42) used with
/// 0xC0 or 0xC1.
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
  /// Mean torque of the run above which there is advice, as a share of the rated torque. Friction
  /// cancels out in the mean, as its sign changes when the shaft turns back.
  static constexpr double kShare = 0.2;

  /// Returns true during a calibration: the drive must be observed every time.
  bool runs() const { return looks_ > 0; }
  std::optional<Finding> observe(const KnownDrive& drive);

 private:
  double sum_Nm_ = 0;  // of the torques observed during the calibration
  int looks_ = 0;      // number of these observations
};

/// Detects positions that are sent as speeds (0xA2). A host with this mistake changes the value
/// when the shaft's angle reaches it, or sends a path that starts at the shaft's angle.
class SpeedWatch {
 public:
  static constexpr double kLeast_dps = 5;  // smaller values are not judged (assumed)
  static constexpr SimTime kHeld = std::chrono::milliseconds(100);  // by each value (assumed)
  static constexpr int kArrivals = 3;                               // assumed: twice may be chance
  /// Distance at which the angle has reached the value, apart from the travel in kReaction_s
  /// (assumed).
  static constexpr double kNear_deg = 2;
  static constexpr double kReaction_s = 0.02;  // of a host that reads at 50 Hz (assumed)
  static constexpr SimTime kJustRead = std::chrono::seconds(1);  // age of the angle (assumed)
  static constexpr double kStart_deg = 0.3;  // includes the first step of a path (assumed)
  static constexpr double kStep_dps = 5;     // longest step of a path (assumed)
  static constexpr int kSteps = 10;          // of a path, until advice (assumed)

  std::optional<Finding> on_query(const DecodedQuery& query, const KnownDrive& drive);

 private:
  bool starts_at_shaft(double value, SimTime at, const KnownDrive& drive) const;
  std::optional<Finding> follow_path(double value);
  std::optional<Finding> leave_target(double value, SimTime at, const KnownDrive& drive);

  std::optional<SimTime> angle_read_;
  std::optional<double> value_;  // last speed command, if it is in force
  SimTime since_{0};             // start of `value_`
  int arrivals_ = 0;             // values in a row that the shaft's angle reached
  double arrived_dps_ = 0;       // absolute value of the last of them
  std::optional<int> steps_;     // of a path that began at the shaft's angle; empty: no path
};

}  // namespace lk::emulator
