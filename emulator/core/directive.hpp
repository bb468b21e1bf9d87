#pragma once

/// @file What can be done to a running bus besides sending frames: plain values, handled by the
/// core.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "emulator/core/body_state.hpp"
#include "emulator/core/condition.hpp"
#include "emulator/core/fault.hpp"
#include "emulator/core/parameter_memory.hpp"
#include "emulator/core/sim_time.hpp"
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

/// Somebody at the drive, not on the wire, writes a setting to RAM and ROM. Nothing happens while
/// the drive is dead or its flash has too much to do.
struct Setting {
  RomParameter parameter = RomParameter::kMaxSpeed;
  Registers value;  // what `parameter` is in here
};

// Of the bus as a whole.
struct SetFault {
  Fault fault;
};
/// The fault of this name, all of this kind, or "all"; "planned": all directives, faults aside,
/// that wait for their time or their condition.
struct ClearFault {
  std::string which;
};
inline constexpr std::string_view kPlanned = "planned";
/// What pushes a part of the body, in the axes of the world, at the part's centre of mass.
struct Push {
  std::size_t part = 0;  // of Mechanism::parts()
  std::array<double, 3> force_N{};
  std::array<double, 3> torque_Nm{};
  SimTime duration{0};
};
/// A part of the body carries so much at its centre of mass, in place of what it carried.
struct CarriedMass {
  std::size_t part = 0;
  double mass_kg = 0;
};
/// The body stands still, or moves again, from rest.
struct Freeze {
  bool on = true;
};
/// The ground is so much higher from there on, along +x; of 0: nowhere.
struct FloorStep {
  double height_m = 0;
  double from_x_m = 0;
};
/// The ground that the body stands on. What is not said stays as it is.
struct Floor {
  std::optional<double> friction;   // sliding, of whatever touches it
  std::optional<double> slope_rad;  // it rises along +x
  std::optional<FloorStep> step = std::nullopt;
};
/// The body is put there, at rest. What is not said stays where it is.
struct Pose {
  struct JointAt {
    std::size_t joint = 0;  // of Mechanism::joints()
    double angle_rad = 0;
  };
  std::optional<std::size_t> keyframe;  // of Mechanism::keyframes(), before all else
  std::size_t part = 0;                 // that goes where it likes
  std::optional<Triple> position_m;     // its
  std::optional<Triple> rpy_rad;        // turned about the world's x, then y, then z
  std::vector<JointAt> joints;
};
/// Of the body that drives of the bus are on; done when its next step begins.
struct BodyAct {
  std::variant<Push, CarriedMass, Freeze, Floor, Pose> what;
};
/// Nothing but a note in logs and recordings.
struct Mark {
  std::string text;
};

/// To the drive `id`, which must be on the bus; SetFault, ClearFault, BodyAct and Mark have
/// kWholeBus.
struct Directive {
  int id = kWholeBus;
  std::variant<PowerOn, PowerOff, PowerCycle, SupplyVoltage, Sag, AmbientTemperature, Load,
               TurnShaft, Setting, SetFault, ClearFault, BodyAct, Mark>
      what;
};

/// To be done at `at`, or, with a condition, at the first instant from then on at which it holds.
struct TimedDirective {
  SimTime at{0};
  Directive directive;
  std::optional<Condition> when = std::nullopt;
  // The words that asked for it, without its time, as JSON: for recordings. Of the directives that
  // one request made, the first has them.
  std::string said = {};
};

}  // namespace lk::emulator
