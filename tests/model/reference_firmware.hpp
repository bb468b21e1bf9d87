#pragma once

/// @file A drive's firmware with an external plant.

#include <array>
#include <cstdint>

#include "model/control/current_loop.hpp"
#include "model/control/current_loop_params.hpp"
#include "model/control/motion_loops.hpp"
#include "model/plant/sensors.hpp"
#include "model/plant/thermal.hpp"
#include "model/transforms.hpp"
#include "model/trig.hpp"
#include "tests/model/reference_solver.hpp"

namespace lk::model::test {

/// The firmware alone, for any plant: the part of DriveBank between sensors and duties.
class Firmware {
 public:
  Firmware(const DriveParams& drive, const ControlSettings& settings)
      : drive_(drive),
        plant_(plant_params(drive)),
        motion_params_(motion_params(drive, settings)),
        loop_params_(current_loop_params(drive, settings)),
        motion_(motion_state_at(motion_params_, 0.0)) {}

  void command(const Setpoint& setpoint) {
    setpoint_changed(motion_params_, setpoint_, setpoint, loop_.encoder_counts, motion_);
    setpoint_ = setpoint;
  }
  /// Runs one period: reads the sensors now, returns the duties for this period.
  std::array<double, 3> step(const ReferenceState& s) {
    const double v_bus =
        measure_slowly(slow_sensors(drive_.slow_sensor), s[4], {s[5], s[6], s[7]}, noise_).v_bus;
    if (tick_++ % drive_.control.motion_divider == 0) {
      motion_loops(motion_params_, setpoint_, loop_.encoder_counts, v_bus, motion_, orders_);
    }
    const std::array<double, 3> acting{loop_.duty_a, loop_.duty_b, loop_.duty_c};
    const SinCos<double> theta_e = sincos(plant_.pole_pairs * s[2]);
    const Abc<double> i = inverse_clarke(inverse_park(Dq<double>{s[0], s[1]}, theta_e));
    const Measurement<double> m = measure<double>(plant_, i, s[2], s[3], noise_);
    current_loop(loop_params_, orders_, hold(loop_params_, orders_), m, loop_);
    return acting;
  }

 private:
  DriveParams drive_;
  PlantParams<double> plant_;  // for the sensor parameters
  MotionParams motion_params_;
  CurrentLoopParams<double> loop_params_;
  MotionState motion_;
  CurrentLoopState<double> loop_;
  CurrentOrders<double> orders_;
  Setpoint setpoint_ = Idle{};
  std::uint64_t noise_ = 1;  // all amplitudes are zero here
  int tick_ = 0;
};

}  // namespace lk::model::test
