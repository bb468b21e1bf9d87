#pragma once

#include <cstddef>
#include <vector>

#include "emulator/core/rom_write.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Returns the present ROM contents of `servo` as a RomWrite.
RomWrite rom_write(const Servo& servo);

/// Flash of a drive: the queue of unfinished writes. A value.
class Memory {
 public:
  bool idle() const { return writes_.empty(); }
  std::size_t size() const { return writes_.size(); }
  /// Queues the write that `servo` made at `at`. Returns when the flash will have completed it.
  SimTime begin(SimTime at, const Servo& servo);
  /// Removes and returns the first write, which is done.
  RomWrite finish();
  /// Drops all writes: restores the ROM of `servo` to the state before the first one. Returns false
  /// if none was pending.
  bool lose_power(Servo& servo);
  /// Sets `parameter` to its value in `rom`, before and after each pending write, and adds `wear`
  /// to its write count. Returns false if none is pending.
  bool damage(RomParameter parameter, const Registers& rom, std::uint32_t wear = 0);
  /// Sets the ROM contents that the first write replaces.
  void set_before(const Registers& rom, const RomWear& wear);

 private:
  struct Write {
    SimTime done;
    RomWrite after;
    Registers rom_before;
    RomWear wear_before;
  };
  std::vector<Write> writes_;
};

}  // namespace lk::emulator
