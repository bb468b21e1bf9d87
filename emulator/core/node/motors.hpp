#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/sim_time.hpp"
#include "model/drive_bank.hpp"

namespace lk::emulator {

/// Where a drive's motor is computed.
struct MotorPlace {
  std::size_t bank;  // of those of its PWM rate
  std::size_t lane;
};

/// The motors of a bus: one bank for each PWM rate, filled in the order of the drives. A value.
class Motors {
 public:
  explicit Motors(const BusConfig& config);
  /// Of one of the configuration's drives.
  MotorPlace place_of(const ServoConfig& servo, const BusConfig& config) const;

  Lane lane(const MotorPlace& place) { return {banks_[place.bank].drives, place.lane}; }
  const model::DriveBank& bank(const MotorPlace& place) const { return banks_[place.bank].drives; }
  std::int64_t f_pwm_Hz(const MotorPlace& place) const { return banks_[place.bank].f_pwm_Hz; }
  bool alive(const MotorPlace& place) const { return bank(place).alive(place.lane); }
  /// When its last tick was.
  SimTime time(const MotorPlace& place) const;
  /// All motors to `t`, or to the first instant before at which a drive dies or wakes; true then.
  bool advance_to(SimTime t);
  /// The same of one motor, and those that are computed with it.
  bool advance_to(SimTime t, const MotorPlace& place);

 private:
  struct Bank {
    std::int64_t f_pwm_Hz;
    model::DriveBank drives;
  };
  std::vector<Bank> banks_;
};

}  // namespace lk::emulator
