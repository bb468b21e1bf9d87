#pragma once

#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Errors cleared again and again because the reply shows those from before.
class ClearWatch {
 public:
  static constexpr SimTime kWithin = std::chrono::seconds(5);
  static constexpr int kTimes = 3;

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  SimTime first_{0};
  int times_ = 0;
};

/// The first target after a start, for a turn count that the drive no longer has.
class FirstTargetWatch {
 public:
  static constexpr double kFar_deg = 180;

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  std::uint32_t known_start_ = 0;  // since which the host knows where the shaft is, or has moved
};

/// A drive that was asked once whether it has a command, 0x30 or 0xC0, and did not answer.
class GuessWatch {
 public:
  static constexpr SimTime kNotAgain = std::chrono::seconds(5);  // assumed
  static constexpr int kOthers = 10;                             // assumed

  /// A frame of 8 bytes for the drive, whether it knows the command or not.
  std::optional<Finding> hear(SimTime at, std::uint8_t command);
  void hear_reply(std::uint8_t command);

 private:
  struct Probe {
    SimTime at{0};
    int times = 0;
    int others = 0;  // queries since
    bool answered = false;
  };
  Probe gains_, parameter_;  // by 0x30, by 0xC0
};

}  // namespace lk::emulator
