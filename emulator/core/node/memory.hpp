#pragma once

#include <cstddef>
#include <vector>

#include "emulator/core/rom_write.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// What stands in the ROM of `servo` now, as the news of it.
RomWrite rom_write(const Servo& servo);

/// The flash of a drive: writes that it has not taken yet, one after the other. A value.
class Memory {
 public:
  bool idle() const { return writes_.empty(); }
  std::size_t size() const { return writes_.size(); }
  /// `servo` has written its ROM at `at`. Returns when the flash will have taken it.
  SimTime begin(SimTime at, const Servo& servo);
  /// The first write is done.
  RomWrite finish();
  /// Without power the ROM of `servo` holds what stood there before the first write. Returns
  /// whether any was under way.
  bool lose_power(Servo& servo);
  /// `parameter` is what it is in `rom` from now on, whatever becomes of the writes, and has been
  /// written `wear` times more. Returns false when there are none.
  bool damage(RomParameter parameter, const Registers& rom, std::uint32_t wear = 0);
  /// What the first write replaces is this.
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
