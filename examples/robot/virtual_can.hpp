#pragma once

#include <algorithm>
#include <cstddef>
#include <lk/emulator/core/bus/bus.hpp>
#include <optional>
#include <vector>

#include "host/can_port.hpp"

namespace robot {

/// A bus of virtual drives in virtual time: it passes while the robot's code waits, and at no other
/// moment. A second takes as long as computing it takes, and is the same second on every machine.
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
      // To the next thing that happens, so that a reply is handed out when it came.
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

  lk::emulator::Bus bus;  // for what happens besides frames, and for a look behind the scenes

 private:
  std::vector<lk::emulator::TimedFrame> replies_;
  std::size_t next_ = 0;
};

}  // namespace robot
