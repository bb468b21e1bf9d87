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

/// Holds replies of a bus for the disk. A reply that acknowledges a ROM write leaves when the write
/// is durable. Later replies of the same drive wait behind it; other drives do not wait. Content
/// and time of a reply are decided before.
class RomGate {
 public:
  /// Limit of held replies per drive; later ones are useless to a host.
  static constexpr std::size_t kMostHeld = 1024;

  /// Known ROM content of a drive.
  struct Kept {
    Registers rom;
    RomWear wear{};
  };

  explicit RomGate(const BusConfig& bus);

  /// Notes that a write is pending.
  void begin(const RomWrite& write) { drives_.at(write.id).begun = write.number; }
  /// Passes a reply that is due: appends it to `out` unless it must wait.
  void pass(const TimedFrame& reply, std::vector<protocol::Frame>& out);
  /// Notes that `write` and earlier writes of that drive are durable, or lost. Appends released
  /// replies. Returns the content that the ROM must be restored to, or null.
  const Kept* settle(const RomWrite& write, bool durable, std::vector<protocol::Frame>& out);

  /// Number of drives with a pending write.
  std::size_t waiting() const;
  bool idle() const { return waiting() == 0; }
  std::uint64_t failed_writes() const { return failed_writes_; }
  /// Replies dropped because their write failed or too many waited.
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
    std::deque<Range> failed;  // until a reply acknowledges a later write
    std::deque<TimedFrame> held;
  };

  void release(Drive& drive, const TimedFrame& reply, std::vector<protocol::Frame>& out);

  std::map<int, Drive> drives_;  // by ID
  std::uint64_t failed_writes_ = 0;
  std::uint64_t lost_replies_ = 0;
};

}  // namespace lk::emulator
