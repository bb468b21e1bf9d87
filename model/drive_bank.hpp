#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "model/drive_params.hpp"
#include "model/faults.hpp"
#include "model/lane_kernel.hpp"
#include "model/setpoint.hpp"

namespace lk::model {

/// Initial state of one drive.
struct DriveInit {
  DriveParams params;
  ControlSettings settings;
  std::uint64_t seed = 1;        // noise only
  double theta_m = 0.0;          // rad, rotor angle at power-up
  bool connected = true;         // false: supply disconnected, link empty
  std::optional<double> temp{};  // °C, all parts at power-up; empty: ambient
};

/// A body simulated elsewhere and fixed to the output shaft. For a short time from now, the body
/// moves by J·dω/dt = torque of the drive + tau.
struct Mount {
  double theta = 0.0, omega = 0.0;  // rad, rad/s: state of the shaft in the body simulation
  double J = 0.0;                   // kg·m², > 0: without the drive's own inertia
  double tau = 0.0;                 // Nm
  /// True: the gear is compliant, but too stiff for the body's time step. The body sees rotor and
  /// output as one inertia at their inertia-weighted mean angle. The drive computes the vibration.
  bool stiff = false;
  /// True: the shaft was put at `theta` by hand, without turning; drive and body are at rest.
  bool posed = false;
};
/// State of a mounted shaft, for the body simulation.
struct MountedShaft {
  double theta = 0.0, omega = 0.0;  // rad, rad/s, at the output
  double armature = 0.0;  // kg·m²: flange, plus the rotor if the body sees both as one inertia
};

/// Inputs of a drive: all that the owner of the bank has set.
struct DriveInputs {
  DriveParams params;  // without the effect of faults
  ControlSettings settings;
  bool connected = true;
  Setpoint setpoint = Idle{};  // in force: Off after a protection has tripped
  Faults faults;
};

class DriveBank;

/// Reference to a drive of a bank.
struct DriveOf {
  const DriveBank* bank;
  std::size_t drive;
};

/// Drives with one common PWM rate, advanced together, tick by tick. A copy of a bank has the whole
/// physical state. Drives do not influence each other: a drive gives the same results in any bank.
class DriveBank {
 public:
  /// Pre: at least one drive; all `f_pwm` are equal. A drive whose supply is connected and has at
  /// least `v_reset` starts as after power-up: bridge on, Idle, no errors. `kernel` is for tests.
  explicit DriveBank(std::span<const DriveInit> drives, NamedKernel kernel = best_lane_kernel());
  /// Copies drives out of one or several banks. Pre: at least one drive; all have the same `f_pwm`
  /// and are at the same tick. The kernel is that of the first drive's bank.
  explicit DriveBank(std::span<const DriveOf> drives);
  DriveBank(const DriveBank& other);
  DriveBank(DriveBank&& other) noexcept;
  DriveBank& operator=(DriveBank other) noexcept;
  ~DriveBank();

  std::size_t size() const;
  /// Returns the number of ticks that this drive, or all drives, have completed; tick n happens at
  /// n/f_pwm.
  std::int64_t ticks(std::optional<std::size_t> drive = {}) const;
  void advance(std::int64_t n_ticks);
  /// Advances all drives to tick `until`. Returns true if a drive died or came alive before: that
  /// drive, and the drives computed with it, then stop after that tick. Call again to continue.
  /// With `only`, advances just this drive and the drives computed with it, which are always the
  /// same drives.
  bool advance_to_edge(std::int64_t until, std::optional<std::size_t> only = {});
  /// Returns true if the controller has power and has booted.
  bool alive(std::size_t drive) const;

  // The functions below act at the next tick.
  void command(std::size_t drive, const Setpoint& setpoint);
  void configure(std::size_t drive, const ControlSettings& settings);
  /// Restarts the controller: Idle; errors, timers and observers as after power-up.
  void restart(std::size_t drive);
  /// Clears latched errors whose cause has ended; the bridge stays off until the next setpoint.
  void clear_errors(std::size_t drive);
  /// Restarts the time-out of the lost-input protection. Call on each accepted frame.
  void feed_input(std::size_t drive);

  void set_load(std::size_t drive, const LoadParams& load);
  void set_supply_voltage(std::size_t drive, double v_source);
  /// Sets the voltage drop that other drives cause at the source, V; initially 0.
  void set_supply_drop(std::size_t drive, double v_drop);
  /// Connects or disconnects the supply. A disconnected drive runs from its link until it is empty.
  void connect_supply(std::size_t drive, bool connected);
  /// Switches the current through the brake's coil, which releases the brake. A drive that loses
  /// power switches the coil off.
  void set_brake_coil(std::size_t drive, bool on);
  /// Turns the output by `angle` rad, as by hand, at most to the end stops. The rotor turns too,
  /// unless the coupling is broken.
  void turn_shaft(std::size_t drive, double angle);
  void set_ambient_temperature(std::size_t drive, double temp_ambient);
  /// Fixes the output to a body simulated elsewhere, which replaces the load. Call again whenever
  /// the body has moved. Moves the output to the body's state, and the rotor too if the body sees
  /// both as one. The energy change counts as work of the load.
  void mount(std::size_t drive, const Mount& mount);
  /// Returns the state of a mounted shaft. The angle does not jump when a broken coupling is
  /// reconnected at another rotor angle.
  MountedShaft mounted_shaft(std::size_t drive) const;
  /// Adds an angular momentum of `impulse` Nm·s to the output and all rigidly connected inertias.
  void kick(std::size_t drive, double impulse);

  /// Replaces all faults of the drive. The instant energy change (a reconnected coupling, a new
  /// inertia) counts as work of the load.
  void set_faults(std::size_t drive, const Faults& faults);
  /// Returns true if the faults of `one`, without any others, have an effect on the drive now
  /// (criteria: docs/internals/model.md §14). The faults need not be active; for inactive faults,
  /// effects that build up over time do not count.
  bool takes_effect(std::size_t drive, const Faults& one) const;

  const DriveInputs& inputs(std::size_t drive) const;
  Telemetry telemetry(std::size_t drive) const;
  Truth truth(std::size_t drive) const;
  EnergyLedger energy(std::size_t drive) const;

 private:
  /// Defined in drive_bank_state.hpp, which only the sources of DriveBank include.
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lk::model
