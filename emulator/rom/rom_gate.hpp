#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/rom_write.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Where the replies of one bus wait for the disk: one that acknowledges a ROM write leaves when
/// that is durable, and whatever the same drive says after it leaves behind it. Other drives are
/// not kept waiting. What a reply says and when it is due is decided before it comes here.
class RomGate {
 public:
  /// Replies held for one drive; later ones are of no use to a host.
  static constexpr std::size_t kMostHeld = 1024;

  /// What a drive's ROM is known to hold.
  struct Kept {
    Registers rom;
    RomWear wear{};
  };

  explicit RomGate(const BusConfig& bus);

  /// A write is on its way to the disk.
  void begin(const RomWrite& write) { drives_.at(write.id).begun = write.number; }
  /// A reply is due; appended to `out` unless it has to wait.
  void pass(const TimedFrame& reply, std::vector<protocol::Frame>& out);
  /// `write` and all before it from that drive are durable, or lost. Appends what may leave now.
  /// Gives what the drive's ROM has to go back to, if it has to.
  const Kept* settle(const RomWrite& write, bool durable, std::vector<protocol::Frame>& out);

  /// Drives that have a write on its way.
  std::size_t waiting() const;
  bool idle() const { return waiting() == 0; }
  std::uint64_t failed_writes() const { return failed_writes_; }
  /// Replies dropped because what they acknowledge failed, or because too many waited.
  std::uint64_t lost_replies() const { return lost_replies_; }

 private:
  /// The writes `after` < number <= `last`.
  struct Range {
    std::uint64_t after;
    std::uint64_t last;
  };
  struct Drive {
    Kept kept;
    std::uint64_t begun = 0;
    std::uint64_t settled = 0;
    std::deque<Range> failed;  // not yet acknowledged by a reply
    std::deque<TimedFrame> held;
  };

  void release(Drive& drive, const TimedFrame& reply, std::vector<protocol::Frame>& out);

  std::map<int, Drive> drives_;  // by ID
  std::uint64_t failed_writes_ = 0;
  std::uint64_t lost_replies_ = 0;
};

}  // namespace lk::emulator
