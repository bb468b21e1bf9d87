#pragma once

#include <cstddef>
#include <cstdint>

#include "emulator/core/bus_config.hpp"
#include "model/drive_bank.hpp"

namespace lk::emulator {

/// Motor of one servo: a bank, and the index of the motor in it. Valid while the bank is not moved.
struct Lane {
  model::DriveBank& bank;
  std::size_t index;

  void command(const model::Setpoint& setpoint) const { bank.command(index, setpoint); }
  void configure(const model::ControlSettings& settings) const { bank.configure(index, settings); }
  void clear_errors() const { bank.clear_errors(index); }
  void restart() const { bank.restart(index); }
  void feed_input() const { bank.feed_input(index); }
  void set_brake_coil(bool on) const { bank.set_brake_coil(index, on); }
  void set_supply_drop(double drop_V) const { bank.set_supply_drop(index, drop_V); }
  void mount(const model::Mount& mount) const { bank.mount(index, mount); }
  model::Telemetry telemetry() const { return bank.telemetry(index); }
};

/// Returns the rotor angle in rad for the boot angle `angle_deg` of `config`.
double start_theta_m(const ServoConfig& config, double angle_deg);

/// Returns the motor of `config` in its state at power-up. `bus_seed` and the ID determine the
/// noise, and also the boot angle if the configuration has none.
model::DriveInit make_drive(const ServoConfig& config, std::uint64_t bus_seed);

}  // namespace lk::emulator
