#pragma once

#include <algorithm>
#include <cstddef>
#include <lk/emulator/core/bus/bus.hpp>
#include <optional>
#include <vector>

#include "host/can_port.hpp"

namespace robot {

/// A bus of virtual drives in virtual time, which only advances while the robot's code waits. The
/// results are equal on every machine, and a second takes only its computing time.
class VirtualCan : public CanPort {
 public:
  explicit VirtualCan(const lk::emulator::BusConfig& config) : bus(config) {}

  void send(const CanFrame& frame) override {
    lk::emulator::TimedFrame sent{.at = bus.time(), .frame = {.id = frame.id}};
    std::ranges::copy(frame.data, sent.frame.data.begin());
    bus.receive(sent);
  }

  std::optional<CanFrame> receive(std::chrono::microseconds timeout) override {
    const lk::emulator::SimTime deadline = bus.time() + timeout;
    while (next_ == replies_.size() && bus.time() < deadline) {
      // Advances to the next event, so that a reply is returned at its time of arrival.
      bus.advance_to(std::min(bus.next_due().value_or(deadline), deadline));
      replies_.clear();
      next_ = 0;
      bus.take_replies(replies_);
    }
    if (next_ == replies_.size()) {
      return std::nullopt;
    }
    const auto& reply = replies_[next_++].frame;
    CanFrame received{.id = reply.id};
    std::copy_n(reply.data.begin(), received.data.size(), received.data.begin());
    return received;
  }

  void wait(std::chrono::microseconds duration) override { bus.advance_to(bus.time() + duration); }

  lk::emulator::Bus bus;  // public for faults and true values

 private:
  std::vector<lk::emulator::TimedFrame> replies_;
  std::size_t next_ = 0;
};

}  // namespace robot
