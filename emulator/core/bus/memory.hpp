#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "emulator/core/rom_write.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Supply of a drive as set by directives: voltage, ramp of the voltage, and whether the controller
/// runs. Copies are independent.
class Power {
 public:
  Power(double supply_V, bool is_alive) : alive(is_alive), supply_V_(supply_V) {}

  bool alive;  // the controller runs

  double supply_V() const { return supply_V_; }
  /// Starts a ramp of the voltage to `to_V` within `within`. Cancels an earlier ramp or sag.
  void move(double to_V, SimTime now, SimTime within);
  /// Starts a drop to `to_V`. A sag within a sag ends at the voltage from before the outer sag.
  void sag(double to_V, SimTime now);
  /// Pre: a sag is active. Returns the voltage to restore at its end.
  double after_sag_V() const { return *after_sag_V_; }
  /// Pre: `move` or `sag` has started a change. Sets the voltage at `now`. Returns the time of the
  /// next step; nullopt at the end of the change.
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

/// Flash of a drive: the queue of unfinished writes. Copies are independent.
class Memory {
 public:
  bool idle() const { return writes_.empty(); }
  std::size_t size() const { return writes_.size(); }
  /// Queues the write that `servo` made at `at`. Returns when the flash will have completed it.
  SimTime begin(SimTime at, const Servo& servo);
  /// Pre: `!idle()`. Removes and returns the oldest write, which the flash has completed.
  RomWrite finish();
  /// Drops all pending writes: restores the ROM of `servo` to the contents before the oldest one.
  /// Returns false if no write was pending.
  bool lose_power(Servo& servo);
  /// Changes the contents before and after each pending write: sets `parameter` to its value in
  /// `rom` and adds `wear` to its write count. Returns false if no write is pending.
  bool damage(RomParameter parameter, const Registers& rom, std::uint32_t wear = 0);
  /// Pre: `!idle()`. Sets the ROM contents that the oldest pending write replaces.
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
