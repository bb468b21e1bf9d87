#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Drives, present or not, that are polled without ever an answer, between queries to others.
class DeadWatch {
 public:
  static constexpr int kInARow = 20;
  static constexpr SimTime kLong = std::chrono::seconds(2);  // a host may notice by then (assumed)
  static constexpr SimTime kPause =
      std::chrono::milliseconds(500);  // a host that waits longer backs off (assumed)

  /// Processes a host's frame for the drive `id`.
  std::optional<Finding> hear(const TimedFrame& in, int id);
  void hear_reply(int id);

 private:
  struct Polled {
    SimTime since{0};
    SimTime last{0};
    int in_a_row = 0;
    bool elsewhere = false;  // it has replied here: a drive of another program
  };
  std::array<Polled, protocol::kMaxId + 1> polled_{};
  int asked_last_ = 0;
};

/// Queries sent while the previous reply is still in the hosts' adapter.
class TimeoutWatch {
 public:
  static constexpr int kTimes = 10;

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);
  void hear_reply();

 private:
  SimTime last_{0};
  int waiting_ = 0;     // replies
  bool early_ = false;  // the last query came before the previous reply
  int times_ = 0;       // and that reply came later
};

}  // namespace lk::emulator
