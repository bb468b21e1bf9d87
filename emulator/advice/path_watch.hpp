#pragma once

#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Detects a stream of targets (0xA3, 0xA4) with a step that the motor cannot follow. A host that
/// sends single targets does not stream.
class JumpWatch {
 public:
  static constexpr SimTime kStream = std::chrono::milliseconds(50);  // between targets (assumed)
  static constexpr int kMoving = 8;        // changed targets in a row (assumed)
  static constexpr double kTooFast = 1.5;  // times the possible speed: room for jitter (assumed)
  static constexpr double kLeast_deg = 1;  // smaller steps do no harm (assumed)
  /// After a longer pause a host starts a new stream with its own rhythm (assumed).
  static constexpr SimTime kPause = std::chrono::seconds(1);

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  struct Target {
    SimTime at{0};
    double value_deg = 0;
  };
  std::optional<Target> last_;
  /// Returns true if the target comes soon after the last because it was delayed before.
  bool catches_up(double gap_s);

  int moving_ = 0;
  double mean_gap_s_ = 0;  // 0: unknown
  double behind_s_ = 0;    // delay of the stream against its rhythm
};

/// Detects increments that accumulate because the shaft does not follow.
class WindUpWatch {
 public:
  static constexpr SimTime kStream = std::chrono::milliseconds(500);  // longest gap (assumed)
  static constexpr int kIncrements = 10;                              // assumed
  static constexpr double kBehind_s = 1;                              // lag of the shaft (assumed)

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);
  /// Call after each look at the drive.
  void look(const KnownDrive& drive);

 private:
  struct Run {
    SimTime from{0};
    SimTime last{0};
    bool forward = true;
    int count = 0;
    double commanded_deg = 0;
    std::optional<double> shaft_from_deg = std::nullopt;  // at the first look
  };
  std::optional<Run> run_;
};

}  // namespace lk::emulator
