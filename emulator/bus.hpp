#pragma once

#include <optional>
#include <vector>

#include "emulator/bus_config.hpp"
#include "emulator/sim_time.hpp"

namespace lk::emulator {

/// One CAN bus with its drives: a pure function of configuration, seed and timed frames.
/// Splitting `advance_to` at other instants gives the same replies, byte for byte. Copyable.
class Bus {
 public:
  explicit Bus(const BusConfig& config);

  /// A host put `frame` on its interface at `at`. Earlier than `time()` counts as now.
  void receive(const TimedFrame& frame);
  /// Everything that happens up to and including `until`.
  void advance_to(SimTime until);
  /// Moves out the replies that have left the wire since the last call, in order; appended to `out`.
  void take_replies(std::vector<TimedFrame>& out);
  /// When `advance_to` will next have a frame to process or a reply to hand out.
  std::optional<SimTime> next_due() const;
  SimTime time() const;
};

}  // namespace lk::emulator
