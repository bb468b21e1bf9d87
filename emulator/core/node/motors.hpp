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

/// Where a drive's motor is computed.
struct MotorPlace {
  std::size_t bank;  // of those of its PWM rate
  std::size_t lane;
};

/// The motors of a bus: one bank for each PWM rate, filled in the order of the drives. A value: a
/// copy has its motors for itself, even one of motors that are shared.
class Motors {
 public:
  explicit Motors(const BusConfig& config);
  Motors(const Motors& other);
  Motors(Motors&& other) noexcept = default;
  Motors& operator=(const Motors& other);
  Motors& operator=(Motors&& other) noexcept = default;
  ~Motors() = default;
  /// Of one of the configuration's drives.
  MotorPlace place_of(const ServoConfig& servo, const BusConfig& config) const;

  Lane lane(const MotorPlace& place) {
    Bank& bank = banks_[place.bank];
    return {*bank.drives, bank.first + place.lane};
  }
  model::Telemetry telemetry(const MotorPlace& place) const {
    return bank(place).telemetry(index(place));
  }
  model::Truth truth(const MotorPlace& place) const { return bank(place).truth(index(place)); }
  const model::DriveBank& bank(const MotorPlace& place) const { return *banks_[place.bank].drives; }
  /// Of the motor in that bank.
  std::size_t index(const MotorPlace& place) const { return banks_[place.bank].first + place.lane; }
  std::int64_t f_pwm_Hz(const MotorPlace& place) const { return banks_[place.bank].f_pwm_Hz; }
  bool alive(const MotorPlace& place) const { return bank(place).alive(index(place)); }
  /// When its last tick was.
  SimTime time(const MotorPlace& place) const;
  /// All motors to `t`, or to the first instant before at which a drive dies or wakes; true then.
  /// Not of shared ones.
  bool advance_to(SimTime t);
  /// The same of one motor, and those that are computed with it.
  bool advance_to(SimTime t, const MotorPlace& place);

  /// They are in banks with those of other buses, and whoever has these brings them all.
  bool shared() const { return shared_; }
  /// Shared ones have got to `t`.
  bool have_reached(SimTime t) const;

 private:
  friend class SharedMotors;
  struct Bank {
    std::int64_t f_pwm_Hz;
    std::shared_ptr<model::DriveBank> drives;
    std::size_t first = 0;  // of this bus's
    std::size_t count = 0;
  };
  std::vector<Bank> banks_;
  bool shared_ = false;
};

/// Motors of several buses in common banks, so that they fill the lanes of the processor.
class SharedMotors {
 public:
  /// All must stand at the same instant. From now on they are shared.
  explicit SharedMotors(std::span<Motors* const> all);
  /// As of Motors. After an edge every bus has to follow the lives of its drives before it goes on.
  bool advance_to(SimTime t);

 private:
  struct Bank {
    std::int64_t f_pwm_Hz;
    std::shared_ptr<model::DriveBank> drives;
  };
  std::vector<Bank> banks_;
};

}  // namespace lk::emulator
