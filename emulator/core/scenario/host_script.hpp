#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "emulator/core/scenario/scenario.hpp"

namespace lk::emulator {

/// What a host says on one bus, in order of time; what is listed first comes first among equals.
class HostScript {
 public:
  /// The sends of `sends` that are for the bus `bus`; times count from `start`.
  HostScript(const std::vector<HostSend>& sends, std::size_t bus, SimTime start) {
    for (const HostSend& send : sends) {
      if (send.bus != bus || send.times == 0) continue;
      heap_.push_back({send.at + start, heap_.size(), send});
    }
    std::ranges::make_heap(heap_, later);
  }

  /// SimTime::max() when there is no more.
  SimTime next_due() const { return heap_.empty() ? SimTime::max() : heap_.front().at; }
  /// The next frame; there must be one.
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
