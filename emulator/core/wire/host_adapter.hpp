#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/adapter_times.hpp"
#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// What showed of an adapter on a frame.
struct AdapterShown {
  bool late = false;      // by latency, jitter, or the time that the adapter's line takes
  bool batched = false;   // it waits for its time
  bool lost = false;      // the queue was full,
  bool reported = false;  // and the host is to be told: once, until a frame has room again
  bool stalled = false;   // the host's write blocks
};

/// Between one host and its wire, of whatever kind: when a frame gets across, either way, in order.
/// A value; it knows neither the bus nor what frames say.
class HostAdapter {
 public:
  /// `random` begins its own random numbers.
  HostAdapter(const AdapterTimes& times, std::uint64_t random) : times_(times), random_(random) {}

  /// From now on; frames under way keep their times.
  void set(const AdapterTimes& times) { times_ = times; }
  /// Frames have to go through it: it delays them, or others are still under way.
  bool in_use() const { return times_.any() || !waiting_.empty(); }

  struct ToWire {
    SimTime at;  // when it is ready for the wire
    AdapterShown shown;
  };
  /// A host writes a frame at `at`.
  ToWire to_wire(SimTime at);
  /// A frame has come from the wire at `frame.at`. `size` is what it counts in the queue: 1, its
  /// bytes where the adapter knows nothing but bytes, 0 what is never lost. A lost one is not kept.
  AdapterShown from_wire(const TimedFrame& frame, std::size_t size = 1);
  /// How much fits into its queue yet, with a depth.
  std::size_t room() const {
    return times_.depth > 0 ? times_.depth - std::min(times_.depth, waiting_size_) : SIZE_MAX;
  }
  /// Frames of drives under way to the host.
  std::size_t waiting() const;
  /// When the last write that stalled is over.
  SimTime stalled_until() const { return stalled_until_; }
  /// When the next one reaches the host.
  std::optional<SimTime> next_due() const {
    return waiting_.empty() ? std::nullopt : std::optional(waiting_.front().frame.at);
  }
  /// The next one; there must be one. Its time is that at which the host gets it.
  TimedFrame take();

 private:
  struct Direction {
    SimTime line_free{0};
    SimTime last{0};  // nothing overtakes
  };
  struct Waiting {
    TimedFrame frame;
    std::size_t size;
  };
  double draw();
  SimTime across(Direction& way, SimTime at, double mean_us);

  AdapterTimes times_;
  std::uint64_t random_;
  Direction tx_, rx_;
  SimTime stalled_until_{0};
  SimTime heard_{0};              // the last frame from the wire
  std::uint64_t unanswered_ = 0;  // writes since, those in a stall aside
  bool overrun_ = false;          // the last frame was lost
  std::vector<Waiting> waiting_;  // in the order of their times
  std::size_t waiting_size_ = 0;
};

}  // namespace lk::emulator
