#include "emulator/core/node/motors.hpp"

#include <algorithm>
#include <cmath>

#include "emulator/core/wire_timing.hpp"

namespace lk::emulator {
namespace {

std::int64_t f_pwm_Hz_of(const ServoConfig& servo) {
  return std::llround(servo.profile.drive.inverter.f_pwm);
}

/// The events begin with this drive's supply switched off.
bool starts_without_power(const BusConfig& config, int id) {
  return std::ranges::any_of(config.events, [id](const TimedDirective& event) {
    return event.at == SimTime{0} && !event.when && event.directive.id == id &&
           std::holds_alternative<PowerOff>(event.directive.what);
  });
}

/// In the order in which they appear.
std::vector<std::int64_t> pwm_rates_Hz(const BusConfig& config) {
  std::vector<std::int64_t> rates_Hz;
  for (const ServoConfig& servo : config.servos) {
    const std::int64_t rate_Hz = f_pwm_Hz_of(servo);
    if (std::ranges::find(rates_Hz, rate_Hz) == rates_Hz.end()) rates_Hz.push_back(rate_Hz);
  }
  return rates_Hz;
}

}  // namespace

Motors::Motors(const BusConfig& config) {
  for (const std::int64_t rate_Hz : pwm_rates_Hz(config)) {
    std::vector<model::DriveInit> motors;
    for (const ServoConfig& servo : config.servos) {
      if (f_pwm_Hz_of(servo) != rate_Hz) continue;
      motors.push_back(make_drive(servo, config.seed));
      motors.back().connected = !starts_without_power(config, servo.id);
    }
    banks_.push_back({rate_Hz, model::DriveBank(motors)});
  }
}

std::vector<MotorPlace> Motors::places(const BusConfig& config) {
  const std::vector<std::int64_t> rates_Hz = pwm_rates_Hz(config);
  std::vector<std::size_t> lanes(rates_Hz.size());
  std::vector<MotorPlace> places;
  for (const ServoConfig& servo : config.servos) {
    const auto found = std::ranges::find(rates_Hz, f_pwm_Hz_of(servo));
    const auto bank = static_cast<std::size_t>(found - rates_Hz.begin());
    places.push_back({bank, lanes[bank]++});
  }
  return places;
}

SimTime Motors::time(const MotorPlace& place) const {
  return time_of_tick(bank(place).ticks(place.lane), f_pwm_Hz(place));
}

bool Motors::advance_to(SimTime t) {
  bool edge = false;
  for (Bank& bank : banks_) {
    // A command that arrives at `t` acts at the first tick after it.
    edge = bank.drives.advance_to_edge(ticks_until(t, bank.f_pwm_Hz)) || edge;
  }
  return edge;
}

bool Motors::advance_to(SimTime t, const MotorPlace& place) {
  Bank& bank = banks_[place.bank];
  return bank.drives.advance_to_edge(ticks_until(t, bank.f_pwm_Hz), place.lane);
}

}  // namespace lk::emulator
