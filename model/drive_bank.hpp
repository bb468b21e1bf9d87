#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/drive_params.hpp"
#include "model/setpoint.hpp"

namespace lk::model {

/// How one drive is born.
struct DriveInit {
  DriveParams params;
  ControlSettings settings;
  std::uint64_t seed = 1;  // noise only
  double theta_m = 0.0;    // rad, where the shaft stands at power-up
};

/// Drives with one common PWM rate, advanced together, tick by tick. A value: copying it copies the
/// whole physical state. Drives do not influence each other; results do not depend on the company.
class DriveBank {
 public:
  /// All `f_pwm` must be equal. Every drive starts as after power-up: bridge on, Idle, no errors.
  explicit DriveBank(std::span<const DriveInit> drives);

  std::size_t size() const;
  /// Control ticks done since construction; tick n happens at n/f_pwm.
  std::int64_t ticks() const;
  void advance(std::int64_t n_ticks);

  // All of these act at the next tick.
  void command(std::size_t drive, const Setpoint& setpoint);
  void configure(std::size_t drive, const ControlSettings& settings);
  /// Clears latched errors whose cause is over; the bridge stays off until the next setpoint.
  void clear_errors(std::size_t drive);
  /// An accepted frame arrived: restarts the lost-input window.
  void feed_input(std::size_t drive);

  void set_load(std::size_t drive, const LoadParams& load);
  void set_supply_voltage(std::size_t drive, double v_source);
  void set_ambient_temperature(std::size_t drive, double temp_ambient);

  Telemetry telemetry(std::size_t drive) const;
  Truth truth(std::size_t drive) const;

 private:
  struct Lane {
    DriveInit init;
    Setpoint setpoint = Idle{};
    double theta = 0, omega = 0;
    ErrorBits errors = 0;
  };
  std::vector<Lane> lanes_;
  std::int64_t ticks_ = 0;
};

}  // namespace lk::model
