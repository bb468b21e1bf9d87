#include "emulator/core/bus/motors.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "emulator/core/wire_timing.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {
namespace {

std::int64_t f_pwm_Hz_of(const ServoConfig& servo) {
  return protocol::rounded(servo.profile.drive.inverter.f_pwm);
}

/// Returns true if an event at time 0 disconnects the supply of this drive.
bool starts_without_power(const BusConfig& config, int id) {
  return std::ranges::any_of(config.events, [id](const TimedDirective& event) {
    return event.at == SimTime{0} && !event.when && event.directive.id == id &&
           std::holds_alternative<PowerOff>(event.directive.what);
  });
}

}  // namespace

Motors::Motors(const BusConfig& config) {
  for (const ServoConfig& first : config.servos) {
    const std::int64_t rate_Hz = f_pwm_Hz_of(first);
    if (std::ranges::find(banks_, rate_Hz, &Bank::f_pwm_Hz) != banks_.end()) continue;
    std::vector<model::DriveInit> motors;
    for (const ServoConfig& servo : config.servos) {
      if (f_pwm_Hz_of(servo) != rate_Hz) continue;
      motors.push_back(make_drive(servo, config.seed));
      motors.back().connected = !starts_without_power(config, servo.id);
    }
    banks_.push_back({rate_Hz, std::make_shared<model::DriveBank>(motors), 0, motors.size()});
  }
}

Motors::Motors(const Motors& other) : banks_(other.banks_) {
  for (Bank& bank : banks_) {
    if (!other.shared_) {
      bank.drives = std::make_shared<model::DriveBank>(*bank.drives);
      continue;
    }
    std::vector<model::DriveOf> own;
    for (std::size_t n = 0; n < bank.count; ++n) own.push_back({bank.drives.get(), bank.first + n});
    bank.drives = std::make_shared<model::DriveBank>(own);
    bank.first = 0;
  }
}

Motors& Motors::operator=(const Motors& other) { return *this = Motors(other); }

MotorLocation Motors::location_of(const ServoConfig& servo, const BusConfig& config) const {
  const std::int64_t rate_Hz = f_pwm_Hz_of(servo);
  const auto bank = std::ranges::find(banks_, rate_Hz, &Bank::f_pwm_Hz) - banks_.begin();
  const auto before = std::ranges::count_if(config.servos, [&](const ServoConfig& other) {
    return other.id < servo.id && f_pwm_Hz_of(other) == rate_Hz;
  });
  return {static_cast<std::size_t>(bank), static_cast<std::size_t>(before)};
}

SimTime Motors::time(const MotorLocation& location) const {
  return time_of_tick(bank(location).ticks(index(location)), f_pwm_Hz(location));
}

bool Motors::advance_to(SimTime t) {
  bool edge = false;
  for (Bank& bank : banks_) {
    // A command that arrives at `t` acts at the first tick after it.
    edge = bank.drives->advance_to_edge(ticks_until(t, bank.f_pwm_Hz)) || edge;
  }
  return edge;
}

bool Motors::advance_to(SimTime t, const MotorLocation& location) {
  Bank& bank = banks_[location.bank];
  return bank.drives->advance_to_edge(ticks_until(t, bank.f_pwm_Hz), location.lane);
}

bool Motors::have_reached(SimTime t) const {
  return std::ranges::all_of(banks_, [t](const Bank& bank) {
    const std::int64_t tick = ticks_until(t, bank.f_pwm_Hz);
    for (std::size_t n = 0; n < bank.count; ++n) {
      if (bank.drives->ticks(bank.first + n) < tick) return false;
    }
    return true;
  });
}

SharedMotors::SharedMotors(std::span<Motors* const> all) {
  std::map<std::int64_t, std::vector<model::DriveOf>> by_rate;
  for (Motors* const motors : all) {
    for (Motors::Bank& bank : motors->banks_) {
      std::vector<model::DriveOf>& drives = by_rate[bank.f_pwm_Hz];
      const std::size_t first = std::exchange(bank.first, drives.size());
      for (std::size_t n = 0; n < bank.count; ++n) {
        drives.push_back({bank.drives.get(), first + n});
      }
    }
  }
  for (const auto& [f_pwm_Hz, drives] : by_rate) {
    banks_.push_back({f_pwm_Hz, std::make_shared<model::DriveBank>(drives)});
  }
  for (Motors* const motors : all) {
    for (Motors::Bank& bank : motors->banks_) {
      bank.drives = std::ranges::find(banks_, bank.f_pwm_Hz, &Bank::f_pwm_Hz)->drives;
    }
    motors->shared_ = true;
  }
}

bool SharedMotors::advance_to(SimTime t) {
  bool edge = false;
  for (const Bank& bank : banks_) {
    edge = bank.drives->advance_to_edge(ticks_until(t, bank.f_pwm_Hz)) || edge;
  }
  return edge;
}

}  // namespace lk::emulator
