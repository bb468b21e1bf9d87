#pragma once

#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// A stream of targets, 0xA3 or 0xA4, with a step that no motor of this kind can follow. A host
/// that gives a target and lets the drive find its way there streams nothing.
class JumpWatch {
 public:
  static constexpr SimTime kStream = std::chrono::milliseconds(50);  // between targets (assumed)
  static constexpr int kMoving = 8;        // so many in a row were new ones (assumed)
  static constexpr double kTooFast = 1.5;  // times what is possible: room for jitter (assumed)
  static constexpr double kLeast_deg = 1;  // smaller steps are nobody's trouble (assumed)
  /// A host that pauses for longer begins a stream of its own rhythm (assumed).
  static constexpr SimTime kPause = std::chrono::seconds(1);

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  struct Target {
    SimTime at{0};
    double value_deg = 0;
  };
  std::optional<Target> last_;
  /// The target follows the last one after `gap_s` because it, or the host, was held up before.
  bool catches_up(double gap_s);

  int moving_ = 0;
  double mean_gap_s_ = 0;  // 0: not known
  double behind_s_ = 0;    // the stream, its own rhythm
};

/// Increments that pile up before a shaft that does not follow.
class WindUpWatch {
 public:
  static constexpr SimTime kStream = std::chrono::milliseconds(500);  // between them (assumed)
  static constexpr int kIncrements = 10;                              // assumed
  static constexpr double kBehind_s = 1;  // the shaft, of what was commanded (assumed)

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);
  /// The drive was just looked at.
  void look(const KnownDrive& drive);

 private:
  struct Run {
    SimTime from{0};
    SimTime last{0};
    bool forward = true;
    int count = 0;
    double commanded_deg = 0;
    std::optional<double> shaft_from_deg = std::nullopt;  // seen at the first look
  };
  std::optional<Run> run_;
};

}  // namespace lk::emulator
