#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Drives, here or not, that are asked all the time and never answer, between others that are asked
/// too.
class DeadWatch {
 public:
  static constexpr int kInARow = 20;
  static constexpr SimTime kLong = std::chrono::seconds(2);  // a host may see it by then (assumed)
  static constexpr SimTime kPause =
      std::chrono::milliseconds(500);  // who waits longer backs off (assumed)

  /// A frame of a host for the drive `id`.
  std::optional<Finding> hear(const TimedFrame& in, int id);
  void hear_reply(int id);

 private:
  struct Polled {
    SimTime since{0};
    SimTime last{0};
    int in_a_row = 0;
    bool elsewhere = false;  // it has replied on this bus, as a drive of another program
  };
  std::array<Polled, protocol::kMaxId + 1> polled_{};
  int asked_last_ = 0;
};

/// Queries behind one whose reply is still on its way through the hosts' adapter.
class TimeoutWatch {
 public:
  static constexpr int kTimes = 10;

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);
  void hear_reply();

 private:
  SimTime last_{0};
  int waiting_ = 0;     // replies
  bool early_ = false;  // the last query came before the reply to the one before
  int times_ = 0;       // that reply came all the same
};

}  // namespace lk::emulator
