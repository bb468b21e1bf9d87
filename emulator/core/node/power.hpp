#pragma once

#include <optional>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// The supply of a drive as directives move it: its voltage, where that is going, and whether the
/// controller lives on it. A value.
class Power {
 public:
  Power(double supply_V, bool is_alive) : alive(is_alive), supply_V_(supply_V) {}

  bool alive;  // the controller runs

  double supply_V() const { return supply_V_; }
  /// From `now` on the voltage moves there, evenly within `within`; what it was about to do is
  /// void, a sag with it.
  void move(double to_V, SimTime now, SimTime within);
  /// It drops there. A sag in a sag ends at what the first would have ended at.
  void sag(double to_V, SimTime now);
  /// What the sag under way ends at.
  double after_sag_V() const { return *after_sag_V_; }
  /// Moves the voltage to where it is at `now`. Returns when to do so again; none: it has arrived.
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
