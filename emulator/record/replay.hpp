#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/bus/bus.hpp"

namespace lk::emulator {

/// A frame on a bus that is replayed.
struct ReplayedFrame {
  TimedFrame timed;
  bool from_host = false;
};

/// Where the emulator did something else than the recording has.
struct Difference {
  std::string bus;
  std::optional<TimedFrame> recorded;  // none: the recording has no such reply
  std::optional<TimedFrame> replayed;  // none: the emulator gave no such reply
  std::vector<ReplayedFrame> before;   // the last frames of that bus on which both agree
};

/// Runs buses on what a recording has, told in its order, and compares the replies: frame, order
/// and time to the microsecond. After the first difference nothing happens any more. A bus is meant
/// by its place `n` in the list.
class Replay {
 public:
  /// Frames that a difference shows of what was before it.
  static constexpr std::size_t kContext = 8;

  explicit Replay(const std::vector<BusConfig>& buses);
  Replay(const Replay&) = delete;
  Replay& operator=(const Replay&) = delete;
  ~Replay() = default;

  std::optional<std::size_t> find(std::string_view interface) const;
  Bus& bus(std::size_t n) { return lines_[n].bus; }

  /// How a bus is brought to an instant; whoever watches it stops on the way.
  std::function<void(std::size_t n, SimTime until)> advance = [this](std::size_t n, SimTime t) {
    lines_[n].bus.advance_to(t);
  };
  /// Hears every frame of the replay.
  std::function<void(std::size_t n, const ReplayedFrame& frame)> on_frame;

  void host_frame(std::size_t n, SimTime at, const protocol::Frame& frame);
  void recorded_reply(std::size_t n, const TimedFrame& reply);
  /// Brings the bus to an instant at which something else is done to it. All replies up to then
  /// were told before; later ones may have been. False after a difference.
  bool bring(std::size_t n, SimTime at);
  /// The recording of this bus ends at `at`.
  void end(std::size_t n, SimTime at);
  /// When the recording last said something of this bus.
  SimTime last(std::size_t n) const { return lines_[n].last; }
  /// The recording breaks off: what the emulator says later than its last line is no difference.
  void break_off();

  const std::optional<Difference>& difference() const { return difference_; }
  std::uint64_t host_frames() const { return host_frames_; }
  std::uint64_t equal_replies() const { return equal_replies_; }

 private:
  struct Line {
    std::string interface;
    Bus bus;
    std::deque<TimedFrame> recorded;  // not compared yet
    std::deque<TimedFrame> replayed;
    std::deque<ReplayedFrame> before;
    SimTime last{0};  // of the recording
  };

  void run(std::size_t n, SimTime until);
  void compare(Line& line);
  void differ(Line& line);
  void note(Line& line, const ReplayedFrame& frame);

  std::vector<Line> lines_;
  std::vector<TimedFrame> taken_;  // kept for its memory
  std::optional<Difference> difference_;
  std::uint64_t host_frames_ = 0;
  std::uint64_t equal_replies_ = 0;
};

}  // namespace lk::emulator
