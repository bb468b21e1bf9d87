#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "emulator/core/rom_write.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Supply of a drive as set by directives: voltage, its ramp, and whether the controller runs. A
/// value.
class Power {
 public:
  Power(double supply_V, bool is_alive) : alive(is_alive), supply_V_(supply_V) {}

  bool alive;  // the controller runs

  double supply_V() const { return supply_V_; }
  /// Ramps the voltage to `to_V` within `within`. Cancels an earlier ramp or sag.
  void move(double to_V, SimTime now, SimTime within);
  /// Drops the voltage to `to_V`. A sag within a sag ends at the voltage of the outer one.
  void sag(double to_V, SimTime now);
  /// Pre: a sag is active. Voltage at its end.
  double after_sag_V() const { return *after_sag_V_; }
  /// Sets the voltage at `now`. Returns the time of the next step; nullopt at the end of a ramp.
  std::optional<SimTime> step(SimTime now);

 private:
  struct Ramp {
    double from_V, to_V;
    SimTime begin, end;
  };
  double supply_V_;
  std::optional<Ramp> ramp_;
  std::optional<double> after_sag_V_;
};

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
