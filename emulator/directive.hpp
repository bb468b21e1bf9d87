#pragma once

/// @file What can be done to a running bus besides sending frames: plain values, handled by the
/// core.

#include <variant>

#include "emulator/sim_time.hpp"
#include "model/drive_params.hpp"

namespace lk::emulator {

// Of one drive.
struct PowerOn {};
struct PowerOff {};  // the supply is disconnected: the link runs empty
/// Off, and on again when `off_for` has passed and the drive is dead: its link feeds it for a
/// while.
struct PowerCycle {
  SimTime off_for{std::chrono::milliseconds(500)};
};
/// The source's voltage moves there, evenly within `ramp`; at once when that is 0.
struct SupplyVoltage {
  double supply_V = 0;
  SimTime ramp{0};
};
/// The source drops there at once, and is back after that time at what it had, or was on its way
/// to. A sag in a sag ends both; whatever else is said of the voltage meanwhile stays.
struct Sag {
  double to_V = 0;
  SimTime duration{0};
};
struct AmbientTemperature {
  double ambient_C = 25;
};
struct Load {
  model::LoadParams load;
};
/// The output shaft is turned by hand, by so much, clockwise positive.
struct TurnShaft {
  double turn_deg = 0;
};

/// To the drive `id`, which must be on the bus.
struct Directive {
  int id = 1;
  std::variant<PowerOn, PowerOff, PowerCycle, SupplyVoltage, Sag, AmbientTemperature, Load,
               TurnShaft>
      what;
};

struct TimedDirective {
  SimTime at{0};
  Directive directive;
};

}  // namespace lk::emulator
