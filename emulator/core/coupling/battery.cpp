#include "emulator/core/coupling/battery.hpp"

#include <algorithm>

#include "model/trig.hpp"

namespace lk::emulator {
namespace {

/// Lower bound, V, of the voltage by which power is divided to get a current.
constexpr double kEmpty = 1.0;

}  // namespace

bool Battery::needed(std::span<const BusConfig> robot) {
  return std::ranges::any_of(robot, [](const BusConfig& bus) { return bus.battery_R_ohm > 0.0; });
}

Battery::Battery(std::span<const BusConfig> robot, std::span<Bus* const> buses)
    : R_ohm_(robot.front().battery_R_ohm) {
  for (std::size_t n = 0; n < robot.size(); ++n) {
    for (const ServoConfig& servo : robot[n].servos) {
      const Bus& bus = *buses[n];
      const double C = servo.profile.drive.supply.C_link;
      links_.push_back({n, servo.id, C, bus.state().drawn_J(servo.id), bus.truth(servo.id).v_bus});
      C_F_ += C;
    }
  }
}

void Battery::exchange(std::span<Bus* const> buses, SimTime passed) {
  const double passed_s = static_cast<double>(passed.count()) * 1e-9;
  double used_A = 0.0;
  for (Link& link : links_) {
    const Bus& bus = *buses[link.bus];
    const double drawn_J = bus.state().drawn_J(link.id);
    const double v_link = bus.truth(link.id).v_bus;
    const double v_mean = 0.5 * (v_link + link.v_link);
    const double stored_J = link.C_link * v_mean * (v_link - link.v_link);
    used_A += (drawn_J - link.drawn_J - stored_J) / passed_s / std::max(v_mean, kEmpty);
    link.drawn_J = drawn_J;
    link.v_link = v_link;
  }
  drop_V_ += (R_ohm_ * used_A - drop_V_) * (1.0 - model::exp_decay(-passed_s / (R_ohm_ * C_F_)));
  for (const Link& link : links_) buses[link.bus]->state().set_supply_drop(link.id, drop_V_);
}

}  // namespace lk::emulator
