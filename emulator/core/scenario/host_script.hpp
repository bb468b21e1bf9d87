#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "emulator/core/scenario/scenario.hpp"

namespace lk::emulator {

/// Frames of a host on one bus, by time; at equal times in the order of the list.
class HostScript {
 public:
  /// Takes the sends for the bus `bus` from `sends`; times count from `start`.
  HostScript(const std::vector<HostSend>& sends, std::size_t bus, SimTime start) {
    for (const HostSend& send : sends) {
      if (send.bus != bus || send.times == 0) continue;
      heap_.push_back({send.at + start, heap_.size(), send});
    }
    std::ranges::make_heap(heap_, later);
  }

  /// Time of the next frame; SimTime::max() if none is left.
  SimTime next_due() const { return heap_.empty() ? SimTime::max() : heap_.front().at; }
  /// Pre: a frame is left. Removes and returns the next one.
  TimedFrame take() {
    std::ranges::pop_heap(heap_, later);
    Next& next = heap_.back();
    const TimedFrame frame{next.at, next.send.frame};
    if (--next.send.times > 0) {
      next.at += next.send.every;
      std::ranges::push_heap(heap_, later);
    } else {
      heap_.pop_back();
    }
    return frame;
  }

 private:
  struct Next {
    SimTime at;
    std::size_t place;
    HostSend send;
  };
  static bool later(const Next& a, const Next& b) {
    return std::pair(a.at, a.place) > std::pair(b.at, b.place);
  }

  std::vector<Next> heap_;
};

}  // namespace lk::emulator
