#pragma once

/// @file Actions on a running bus besides sending frames: plain values, executed by the core.

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

// Directives for one drive.
struct PowerOn {};
struct PowerOff {};  // disconnects the supply; the link capacitor discharges
/// Disconnects the supply. Reconnects it after `off_for`, but not before the controller is dead:
/// the link capacitor feeds the controller for a while.
struct PowerCycle {
  SimTime off_for{std::chrono::milliseconds(500)};
};
/// Ramps the source linearly to `supply_V` within `ramp`; 0: at once.
struct SupplyVoltage {
  double supply_V = 0;
  SimTime ramp{0};
};
/// Drops the source to `to_V`; after `duration` restores the earlier voltage, or the target of the
/// ramp that the sag cut short. The end of a sag within a sag ends both. A SupplyVoltage during the
/// sag cancels the restore.
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
/// Turns the output shaft by hand, clockwise positive.
struct TurnShaft {
  double turn_deg = 0;
};

/// Writes a setting to RAM and ROM at the drive, not over the wire. Ignored if the drive is dead or
/// too many writes of its flash are pending.
struct Setting {
  RomParameter parameter = RomParameter::kMaxSpeed;
  Registers value;  // only the member of `parameter` is used
};

// Directives for the whole bus.
struct SetFault {
  Fault fault;
};
/// Clears the fault of this name, all faults of this kind, or "all". "planned" instead removes all
/// pending directives except faults.
struct ClearFault {
  std::string which;
};
inline constexpr std::string_view kPlanned = "planned";
/// Force and torque on a part of the body, in world axes, at the part's centre of mass.
struct Push {
  std::size_t part = 0;  // index in Mechanism::parts()
  std::array<double, 3> force_N{};
  std::array<double, 3> torque_Nm{};
  SimTime duration{0};
};
/// Sets the mass that a part of the body carries at its centre of mass.
struct CarriedMass {
  std::size_t part = 0;
  double mass_kg = 0;
};
/// Stops the body, or restarts it from rest.
struct Freeze {
  bool on = true;
};
/// Raises the ground by `height_m` from `from_x_m` on, along +x; 0: removes the step.
struct FloorStep {
  double height_m = 0;
  double from_x_m = 0;
};
/// Ground below the body. Absent members stay unchanged.
struct Floor {
  std::optional<double> friction;   // coefficient of sliding friction with all that touches it
  std::optional<double> slope_rad;  // the ground rises along +x
  std::optional<FloorStep> step = std::nullopt;
};
/// Puts the body into a pose, at rest. Absent members stay unchanged.
struct Pose {
  struct JointAt {
    std::size_t joint = 0;  // of Mechanism::joints()
    double angle_rad = 0;
  };
  std::optional<std::size_t> keyframe;  // index in Mechanism::keyframes(); applied first
  std::size_t part = 0;                 // index of the free part to place
  std::optional<Triple> position_m;     // of that part
  std::optional<Triple> rpy_rad;        // rotation about the world's x, then y, then z
  std::vector<JointAt> joints;
};
/// Action on the body of the bus, executed when the body's next step begins.
struct BodyAct {
  std::variant<Push, CarriedMass, Freeze, Floor, Pose> what;
};
/// Adds a note to logs and recordings; no other effect.
struct Mark {
  std::string text;
};

/// Directive for the drive `id`, which must be on the bus. SetFault, ClearFault, BodyAct and Mark
/// use kWholeBus.
struct Directive {
  int id = kWholeBus;
  std::variant<PowerOn, PowerOff, PowerCycle, SupplyVoltage, Sag, AmbientTemperature, Load,
               TurnShaft, Setting, SetFault, ClearFault, BodyAct, Mark>
      what;
};

/// Directive that is executed at `at`. With a condition: at the first instant, not before `at`, at
/// which the condition holds.
struct TimedDirective {
  SimTime at{0};
  Directive directive;
  std::optional<Condition> when = std::nullopt;
  // Source text of the request as JSON, without its time, for recordings. If a request makes
  // several directives, only the first has it.
  std::string source_json = {};
};

}  // namespace lk::emulator
