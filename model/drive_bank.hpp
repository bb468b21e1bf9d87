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

/// How one drive is born.
struct DriveInit {
  DriveParams params;
  ControlSettings settings;
  std::uint64_t seed = 1;        // noise only
  double theta_m = 0.0;          // rad, where the shaft stands at power-up
  bool connected = true;         // false: without supply, the link empty
  std::optional<double> temp{};  // °C, of all of it at power-up; nothing: as the air
};

/// A body that is computed elsewhere and that an output shaft is fixed to, as it responds for a
/// short while from now on: J·dω/dt = torque of the drive + tau.
struct Mount {
  double theta = 0.0, omega = 0.0;  // rad, rad/s: where the body has the shaft
  double J = 0.0;                   // kg·m², > 0: without the drive's own
  double tau = 0.0;                 // Nm
  /// A gear that gives, but so fast that the body does not follow: it has rotor and output as one,
  /// where their common momentum has them, and how they swing against each other is the drive's.
  bool stiff = false;
  /// The shaft did not turn there, it was put there: as by hand, and drive and body are at rest.
  bool put_there = false;
};
/// A shaft that is fixed to a body, as the body is to see it.
struct MountedShaft {
  double theta = 0.0, omega = 0.0;  // rad, rad/s, at the output
  double armature = 0.0;  // kg·m²: the flange, and the rotor where the body has both as one
};

class DriveBank;

/// A drive of some bank.
struct DriveOf {
  const DriveBank* bank;
  std::size_t drive;
};

/// Drives with one common PWM rate, advanced together, tick by tick. A value: copying it copies the
/// whole physical state. Drives do not influence each other; results do not depend on the company.
class DriveBank {
 public:
  /// All `f_pwm` must be equal. Every drive starts as after power-up: bridge on, Idle, no errors.
  /// `kernel` is for tests; by default the fastest one of this processor.
  explicit DriveBank(std::span<const DriveInit> drives, NamedKernel kernel = best_lane_kernel());
  /// These drives as they stand, out of one bank or of several. There must be one, and all of the
  /// same `f_pwm` and at the same tick. The kernel is that of the first one's bank.
  explicit DriveBank(std::span<const DriveOf> drives);
  DriveBank(const DriveBank& other);
  DriveBank(DriveBank&& other) noexcept;
  DriveBank& operator=(const DriveBank& other);
  DriveBank& operator=(DriveBank&& other) noexcept;
  ~DriveBank();

  std::size_t size() const;
  /// Control ticks that all drives have done since construction; tick n happens at n/f_pwm.
  std::int64_t ticks() const;
  /// Those that this drive has done.
  std::int64_t ticks(std::size_t drive) const;
  void advance(std::int64_t n_ticks);
  /// Brings all drives to tick `until`. Returns true when some drive has died or come alive before:
  /// that drive, and those that are computed with it, then stand behind the tick in which it did;
  /// call again to go on.
  bool advance_to_edge(std::int64_t until);
  /// The same of this drive and those that are computed with it, which are always the same ones;
  /// the others stay behind.
  bool advance_to_edge(std::int64_t until, std::size_t drive);
  /// The controller has power and has booted.
  bool alive(std::size_t drive) const;

  // All of these act at the next tick.
  void command(std::size_t drive, const Setpoint& setpoint);
  void configure(std::size_t drive, const ControlSettings& settings);
  /// The controller starts anew: Idle, errors, timers and observers as after power-up.
  void restart(std::size_t drive);
  /// Clears latched errors whose cause is over; the bridge stays off until the next setpoint.
  void clear_errors(std::size_t drive);
  /// An accepted frame arrived: restarts the lost-input window.
  void feed_input(std::size_t drive);

  void set_load(std::size_t drive, const LoadParams& load);
  void set_supply_voltage(std::size_t drive, double v_source);
  /// What other drives cost the source of its voltage, V: to be said again and again. 0 at first.
  void set_supply_drop(std::size_t drive, double v_drop);
  /// Disconnected, the link feeds the drive until it is empty.
  void connect_supply(std::size_t drive, bool connected);
  /// Current through the coil releases the brake. A drive that loses its power lets go of it.
  void set_brake_coil(std::size_t drive, bool on);
  /// Turns the output by `angle` rad, by hand, as far as the end stops let it; the rotor goes with
  /// it, unless they are apart.
  void turn_shaft(std::size_t drive, double angle);
  void set_ambient_temperature(std::size_t drive, double temp_ambient);
  /// The output is fixed to a body that is computed elsewhere, which takes the place of the load:
  /// to be said again and again, as the body moves. The shaft is put there, and the rotor with it
  /// where nothing gives between them; what that changes is booked as done by the load.
  void mount(std::size_t drive, const Mount& mount);
  /// Of one that is mounted. Goes on evenly where a coupling is put together again at another angle
  /// of the rotor.
  MountedShaft mounted_shaft(std::size_t drive) const;
  /// A blow: the output, and what turns with it, gains `impulse` Nm·s at once.
  void kick(std::size_t drive, double impulse);

  /// These faults, and no others, are in force. What changes by that in an instant (a coupling put
  /// together, an inertia) is booked as done by the load.
  void set_faults(std::size_t drive, const Faults& faults);
  const Faults& faults(std::size_t drive) const;
  /// Whether the faults of `one` make a difference at this instant to a drive in this state that
  /// has nothing else (docs/model.md §14 has the criteria). They need not be in force; what only
  /// shows by having been, does not show then.
  bool takes_effect(std::size_t drive, const Faults& one) const;

  // What was said last; params() without what faults make of them.
  const DriveParams& params(std::size_t drive) const;
  bool connected(std::size_t drive) const;
  /// What the loops obey: Off after a protection has tripped.
  const Setpoint& setpoint(std::size_t drive) const;

  Telemetry telemetry(std::size_t drive) const;
  Truth truth(std::size_t drive) const;
  EnergyLedger energy(std::size_t drive) const;

 private:
  /// The output, and the rotor with it, at `theta`, at rest.
  void put_at_rest(std::size_t drive, double theta);
  /// In drive_bank_state.hpp: how the fast tick stores a drive is no business of who has one.
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lk::model
