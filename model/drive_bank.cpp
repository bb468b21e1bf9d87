#include "model/drive_bank.hpp"

#include <algorithm>
#include <cmath>

namespace lk::model {

DriveBank::DriveBank(std::span<const DriveInit> drives) {
  for (const auto& init : drives) {
    lanes_.push_back({init, Idle{}, init.theta_m, 0.0, 0});
  }
}
std::size_t DriveBank::size() const { return lanes_.size(); }
std::int64_t DriveBank::ticks() const { return ticks_; }
void DriveBank::advance(std::int64_t n_ticks) {
  for (std::int64_t k = 0; k < n_ticks; ++k) {
    ++ticks_;
    for (auto& lane : lanes_) {
      const double dt = 1.0 / lane.init.params.inverter.f_pwm;
      const auto& motor = lane.init.params.motor;
      if (const auto* torque = std::get_if<Torque>(&lane.setpoint)) {
        lane.omega += dt * 1.5 * motor.pole_pairs * motor.psi_f * torque->i_q / lane.init.params.mechanics.J;
      } else if (const auto* speed = std::get_if<Speed>(&lane.setpoint)) {
        lane.omega += (speed->omega - lane.omega) * dt * 100.0;
      } else if (const auto* position = std::get_if<Position>(&lane.setpoint)) {
        const double limit = position->omega_max > 0 ? position->omega_max : lane.init.settings.omega_max;
        lane.omega = std::clamp((position->theta - lane.theta) * 50.0, -limit, limit);
      } else {
        lane.omega -= lane.omega * dt * 5.0;
      }
      lane.theta += lane.omega * dt;
    }
  }
}
void DriveBank::command(std::size_t drive, const Setpoint& setpoint) { lanes_[drive].setpoint = setpoint; }
void DriveBank::configure(std::size_t drive, const ControlSettings& settings) { lanes_[drive].init.settings = settings; }
void DriveBank::clear_errors(std::size_t drive) { lanes_[drive].errors = 0; }
void DriveBank::feed_input(std::size_t /*drive*/) {}
void DriveBank::set_load(std::size_t drive, const LoadParams& load) { lanes_[drive].init.params.load = load; }
void DriveBank::set_supply_voltage(std::size_t drive, double v) { lanes_[drive].init.params.supply.v_source = v; }
void DriveBank::set_ambient_temperature(std::size_t drive, double t) { lanes_[drive].init.params.thermal.temp_ambient = t; }
Telemetry DriveBank::telemetry(std::size_t drive) const {
  const auto& lane = lanes_[drive];
  Telemetry t;
  t.temp_motor = lane.init.params.thermal.temp_ambient;
  t.v_bus = lane.init.params.supply.v_source;
  t.omega = lane.omega;
  const double counts = static_cast<double>(1 << lane.init.params.encoder.bits);
  t.encoder_position = std::llround(std::floor(lane.theta / (2 * 3.141592653589793) * counts));
  t.errors = lane.errors;
  t.bridge_on = !std::holds_alternative<Off>(lane.setpoint);
  return t;
}
Truth DriveBank::truth(std::size_t drive) const {
  Truth t;
  t.theta_m = lanes_[drive].theta;
  t.omega_m = lanes_[drive].omega;
  return t;
}

}  // namespace lk::model
