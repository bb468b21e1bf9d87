#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/sim_time.hpp"
#include "emulator/core/wire_timing.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Effects of an adapter on a frame.
struct AdapterEffects {
  bool late = false;      // by latency, jitter, or line time of the adapter
  bool batched = false;   // held back until its batch is due
  bool lost = false;      // the queue was full
  bool reported = false;  // a notice tells the host of the loss: one until a frame fits again
  bool stalled = false;   // the host's write blocks
};

/// Adapter between hosts and their wire, CAN or RS-485: delays frames in both directions and keeps
/// their order. Does not depend on the bus. Copies are independent.
class HostAdapter {
 public:
  /// `random` seeds its random numbers.
  HostAdapter(const AdapterTimes& times, std::uint64_t random) : times_(times), random_(random) {}

  /// Sets the times for frames from now on; frames under way keep theirs.
  void set(const AdapterTimes& times) { times_ = times; }
  std::size_t tx_depth() const { return times_.tx_depth; }
  /// Frames have to pass through the adapter: it delays them, or earlier frames are still under
  /// way.
  bool in_use() const { return times_.any() || !waiting_.empty(); }

  struct ToWire {
    SimTime at;  // time at which the frame is ready for the wire
    AdapterEffects shown;
  };
  /// Returns the delay and effects for a frame that a host writes at `at`.
  ToWire to_wire(SimTime at);
  /// Queues a frame that left the wire at `frame.at`, unless it is lost. `size` is the room that it
  /// takes in the queue: 1 on CAN, its number of bytes on RS-485; 0: the frame is never lost.
  AdapterEffects from_wire(const TimedFrame& frame, std::size_t size = 1);
  /// Free room in the queue to the host; SIZE_MAX if AdapterTimes::depth is 0.
  std::size_t room() const {
    return times_.depth > 0 ? times_.depth - std::min(times_.depth, waiting_size_) : SIZE_MAX;
  }
  /// Number of frames of drives that are under way to the host.
  std::size_t waiting() const;
  /// End of the last stalled write.
  SimTime stalled_until() const { return stalled_until_; }
  /// Time at which the next frame reaches the host.
  std::optional<SimTime> next_due() const {
    return waiting_.empty() ? std::nullopt : std::optional(waiting_.front().frame.at);
  }
  /// Pre: `next_due()` has a value. Removes and returns the next frame, with its arrival time.
  TimedFrame take();

 private:
  struct Direction {
    SimTime line_free{0};
    SimTime last{0};  // arrival of the last frame; the next one is not earlier
  };
  struct Waiting {
    TimedFrame frame;
    std::size_t size;
  };
  double draw();
  SimTime delay_frame(Direction& way, SimTime at, double mean_us);

  AdapterTimes times_;
  std::uint64_t random_;
  Direction tx_, rx_;
  SimTime stalled_until_{0};
  SimTime last_from_wire_{0};     // time of the last frame from the wire
  std::uint64_t unanswered_ = 0;  // writes since that frame, without those during a stall
  bool overrun_ = false;          // the last frame was lost
  std::vector<Waiting> waiting_;  // by ascending time
  std::size_t waiting_size_ = 0;
};

}  // namespace lk::emulator
