#pragma once

/// @file A run with all features: several different drives, all kinds of setpoints, changing loads;
/// and its final bits.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "model/drive_bank.hpp"

namespace lk::model::test {

/// A drive of the mixed run; drives of different `kind` differ in everything that has a branch.
inline DriveInit mixed_drive(int kind) {
  DriveInit init;
  DriveParams& d = init.params;
  const double k = kind;
  init.seed = 100U + static_cast<unsigned>(kind);
  init.theta_m = 0.37 * k;
  d.motor.L_q *= 1.0 + 0.25 * (kind % 5);
  d.motor.pole_pairs = 7 + kind;
  d.mechanics.tau_coulomb = 0.004 * (kind % 4);
  d.mechanics.tau_static = 1.2 * d.mechanics.tau_coulomb;
  d.mechanics.B = 1e-5 * k;
  d.mechanics.tau_cogging = kind % 3 == 0 ? 0.0 : 0.002;
  if (kind % 4 == 1) {
    d.mechanics.gear_ratio = 10.0;
    d.mechanics.gear_efficiency = 0.87;
  }
  if (kind % 4 == 2) {
    d.mechanics.gear_ratio = 6.0;
    d.mechanics.gear_efficiency = 0.9;
    d.mechanics.backlash_out = 0.002;
    d.mechanics.gear_stiffness_out = 400.0;
    d.mechanics.gear_damping_out = 0.3;
    d.mechanics.J_out = 5e-4;
    d.mechanics.tau_coulomb_out = 0.02;
  }
  d.load.tau_gravity = kind % 2 == 0 ? 0.0 : 0.2;
  d.supply.i_regen_max = kind % 3 == 1 ? 0.0 : 1e3;
  d.encoder.bits = kind % 2 == 0 ? 14 : 18;
  d.encoder.direction = kind % 5 == 4 ? -1 : 1;
  d.encoder.offset = 0.1 * k;
  d.encoder.inl_1 = kind % 3 == 2 ? 0.0 : 1e-3;
  d.encoder.inl_2 = kind % 3 == 2 ? 0.0 : 4e-4;
  d.encoder.noise = 4e-5;
  d.current_sensor.offset_a = 0.01 * k;
  d.control.motion_divider = kind % 3 == 0 ? 4 : 6;
  d.control.has_current_loop = kind != 5;
  init.settings.accel_max = kind % 2 == 0 ? 0.0 : 500.0;
  init.settings.current_ramp = kind % 3 == 0 ? 0.0 : 2000.0;
  init.settings.protections[static_cast<std::size_t>(Error::kOverVoltage)] = {true, 36.0, 1.0,
                                                                              0.002};
  return init;
}

/// Commands drive `kind` in stretch `n` of the run.
inline void direct(DriveBank& bank, std::size_t drive, int kind, int n) {
  switch ((kind + n) % 8) {
    case 0:
      bank.command(drive, Speed{30.0 - 9.0 * kind, 0.0});
      break;
    case 1:
      bank.command(drive, Position{4.0 * kind - 2.0 * n, 0.0});
      break;
    case 2:
      bank.command(drive, Torque{2.0 - 0.5 * kind});
      break;
    case 3:
      bank.command(drive, Off{});
      break;
    case 4:
      bank.command(drive, Speed{-120.0, 6.0});
      break;
    case 5:
      bank.command(drive, OpenLoop{0.2});
      break;
    case 6:
      bank.command(drive, Position{-1.0, 60.0});
      break;
    case 7:
      bank.command(drive, Idle{});
      break;
  }
  if (n == 3) {
    bank.set_load(
        drive, {.J = 1e-4, .tau = 0.02, .tau_gravity = 0.1, .theta_min = -20.0, .theta_max = 20.0});
    bank.set_supply_voltage(drive, 22.0);
  }
  if (n == 5) {
    bank.clear_errors(drive);
    bank.set_ambient_temperature(drive, 40.0);
  }
}

/// Some faults of every kind, selected by `kind`.
inline Faults mixed_faults(int kind) {
  Faults f;
  f.encoder = static_cast<EncoderFault>(kind % 4);
  f.encoder_offset = 0.01 * kind;
  f.current_a.gain = 1.0 + 0.1 * (kind % 3);
  f.current_noise = 0.02 * (kind % 2);
  if (kind % 4 == 1) {
    f.current_b.stuck = 0.5;
    f.v_bus_stuck = 20.0;
  }
  f.bridge_dead = kind % 7 == 6;
  f.legs[static_cast<std::size_t>(kind % 3)] = static_cast<LegFault>(kind % 6);
  f.jam = kind % 5 == 4 ? 0.02 : 0.0;
  f.friction = 1.0 + kind % 2;
  f.inertia = 1.0 + 0.5 * (kind % 3);
  f.backlash = 1.0 + kind % 4;
  f.coupling_broken = kind % 8 == 7;
  f.v_source_max = kind % 3 == 2 ? 18.0 : 1e9;
  f.clock_ratio = 1.0 + 0.01 * (kind % 2);
  return f;
}

/// Returns all observable real numbers of a drive.
inline std::vector<double> numbers_of(const DriveBank& bank, std::size_t drive) {
  const Truth t = bank.truth(drive);
  const Telemetry m = bank.telemetry(drive);
  const EnergyLedger e = bank.energy(drive);
  return {t.theta_m,     t.omega_m,   t.theta_out,    t.omega_out,    t.i_d,         t.i_q,
          t.tau_e,       t.v_bus,     t.temp_winding, t.temp_housing, t.temp_stage,  t.i_q_ref,
          t.omega_ref,   t.theta_ref, t.duty_abc[0],  t.duty_abc[1],  t.duty_abc[2], m.temp_motor,
          m.temp_driver, m.v_bus,     m.i_bus,        m.i_q,          m.power,       m.i_a,
          m.i_b,         m.i_c,       m.omega,        e.supply,       e.copper,      e.inverter,
          e.friction,    e.gear,      e.load,         e.stored};
}
inline bool all_finite(const DriveBank& bank, std::size_t drive) {
  const std::vector<double> numbers = numbers_of(bank, drive);
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

/// Returns all observable state of a drive as 64-bit words.
inline std::vector<std::uint64_t> bits_of(const DriveBank& bank, std::size_t drive) {
  const Telemetry m = bank.telemetry(drive);
  std::vector<std::uint64_t> words;
  for (const double x : numbers_of(bank, drive)) words.push_back(std::bit_cast<std::uint64_t>(x));
  words.push_back(static_cast<std::uint64_t>(m.encoder_position));
  words.push_back(m.errors);
  words.push_back(m.bridge_on ? 1 : 0);
  return words;
}

inline constexpr int kStretches = 12;
inline constexpr std::int64_t kStretchTicks = 1200;

/// FNV-1a hash over words.
class Hash {
 public:
  void add(std::uint64_t word) {
    for (int byte = 0; byte < 8; ++byte) {
      value_ = (value_ ^ ((word >> (8 * byte)) & 0xFFU)) * 0x100000001B3U;
    }
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325U;
};

/// Returns the states of `kinds` after every stretch, run together in one bank. `broken`: with
/// mixed_faults() in the odd stretches.
inline std::vector<std::vector<std::uint64_t>> mixed_run(const std::vector<int>& kinds,
                                                         NamedKernel kernel,
                                                         std::int64_t slice = kStretchTicks,
                                                         bool broken = false) {
  std::vector<DriveInit> inits;
  for (const int kind : kinds) {
    inits.push_back(mixed_drive(kind));
  }
  DriveBank bank(inits, kernel);
  std::vector<std::vector<std::uint64_t>> bits(kinds.size());
  for (int n = 0; n < kStretches; ++n) {
    for (std::size_t drive = 0; drive < kinds.size(); ++drive) {
      direct(bank, drive, kinds[drive], n);
      if (broken) {
        bank.set_faults(drive, n % 2 == 0 ? Faults{} : mixed_faults(kinds[drive] + n / 2));
        bank.kick(drive, 1e-4 * n);
      }
    }
    for (std::int64_t done = 0; done < kStretchTicks; done += slice) {
      bank.advance(slice < kStretchTicks - done ? slice : kStretchTicks - done);
    }
    for (std::size_t drive = 0; drive < kinds.size(); ++drive) {
      const auto words = bits_of(bank, drive);
      bits[drive].insert(bits[drive].end(), words.begin(), words.end());
    }
  }
  return bits;
}

}  // namespace lk::model::test
