#pragma once

#include <optional>

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

}  // namespace lk::emulator
