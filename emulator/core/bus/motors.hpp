#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/sim_time.hpp"
#include "model/drive_bank.hpp"

namespace lk::emulator {

/// Location of a drive's motor.
struct MotorLocation {
  std::size_t bank;  // index of the bank for its PWM rate
  std::size_t lane;
};

/// Motors of a bus: one bank for each PWM rate, filled in the order of drives. A copy has separate
/// motors, even if the original's motors are shared.
class Motors {
 public:
  explicit Motors(const BusConfig& config);
  Motors(const Motors& other);
  Motors(Motors&& other) noexcept = default;
  Motors& operator=(const Motors& other);
  Motors& operator=(Motors&& other) noexcept = default;
  ~Motors() = default;
  /// Pre: `servo` is a drive of `config`.
  MotorLocation location_of(const ServoConfig& servo, const BusConfig& config) const;

  Lane lane(const MotorLocation& location) {
    Bank& bank = banks_[location.bank];
    return {*bank.drives, bank.first + location.lane};
  }
  model::Telemetry telemetry(const MotorLocation& location) const {
    return bank(location).telemetry(index(location));
  }
  model::Truth truth(const MotorLocation& location) const {
    return bank(location).truth(index(location));
  }
  const model::DriveBank& bank(const MotorLocation& location) const {
    return *banks_[location.bank].drives;
  }
  /// Index of the motor in its bank.
  std::size_t index(const MotorLocation& location) const {
    return banks_[location.bank].first + location.lane;
  }
  std::int64_t f_pwm_Hz(const MotorLocation& location) const {
    return banks_[location.bank].f_pwm_Hz;
  }
  bool alive(const MotorLocation& location) const { return bank(location).alive(index(location)); }
  /// Time of the motor's last tick.
  SimTime time(const MotorLocation& location) const;
  /// Pre: `!shared()`. Advances all motors to `t`. If a drive dies or starts before, stops at the
  /// first such instant and returns true.
  bool advance_to(SimTime t);
  /// As `advance_to(t)`, for one motor and those that are computed with it.
  bool advance_to(SimTime t, const MotorLocation& location);

  /// The motors are in banks of several buses; SharedMotors advances them.
  bool shared() const { return shared_; }
  /// Shared motors have reached `t`.
  bool have_reached(SimTime t) const;

 private:
  friend class SharedMotors;
  struct Bank {
    std::int64_t f_pwm_Hz;
    std::shared_ptr<model::DriveBank> drives;
    std::size_t first = 0;  // index of this bus's first motor
    std::size_t count = 0;
  };
  std::vector<Bank> banks_;
  bool shared_ = false;
};

/// Motors of several buses in common banks, so that the motors fill the SIMD lanes of the
/// processor.
class SharedMotors {
 public:
  /// Pre: all motors are at the same time. Sets `shared()` of all.
  explicit SharedMotors(std::span<Motors* const> all);
  /// As Motors::advance_to. If it returns true, every bus must update its drives before the next
  /// call.
  bool advance_to(SimTime t);

 private:
  struct Bank {
    std::int64_t f_pwm_Hz;
    std::shared_ptr<model::DriveBank> drives;
  };
  std::vector<Bank> banks_;
};

}  // namespace lk::emulator
