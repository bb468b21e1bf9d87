#pragma once

/// @file Buses with noiseless, frictionless drives, for tests.

#include <chrono>
#include <cstdint>
#include <initializer_list>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/generation.hpp"

namespace lk::test {

/// Returns a drive without noise; it boots at 45°, which is 2048 of 16384 counts.
inline emulator::ServoConfig servo_config(int id) {
  emulator::ServoConfig config;
  config.id = id;
  config.profile.name = "test";
  config.profile.drive.current_sensor.noise = 0;
  config.profile.drive.slow_sensor.v_noise = 0;
  config.rom = config.profile.factory;
  config.boot_angle_deg = 45;
  config.flash.write_time = std::chrono::nanoseconds(0);
  return config;
}

/// Effect of one count of the 14-bit encoder on the reported speed, over 27 periods of 8 kHz;
/// rounded up.
inline constexpr double kSpeedStep_dps = 7;

// LSB of iq from v235 on, by series.
inline constexpr double kMgLsb_A = 66.0 / 4096;
inline constexpr double kMfLsb_A = 33.0 / 4096;

/// Returns such a drive with the firmware of `generation`, of a series.
inline emulator::ServoConfig drive(emulator::Generation generation,
                                   emulator::Series series = emulator::Series::kMg, int id = 1) {
  emulator::ServoConfig config = servo_config(id);
  config.generation = generation;
  config.quirks = emulator::quirks_of(generation);
  config.profile.series = series;
  config.profile.drive.control.has_current_loop = series != emulator::Series::kMs;
  return config;
}

/// Frames take no time unless a bit rate is given.
inline emulator::BusConfig bus_config(std::initializer_list<int> ids, std::int64_t bitrate = 0) {
  emulator::BusConfig config;
  config.interface = "test";
  config.bitrate = bitrate;
  for (const int id : ids) {
    config.servos.push_back(servo_config(id));
  }
  return config;
}

/// Returns a drive whose link is empty 0.45 s after its supply is cut, and that boots in 50 ms.
inline emulator::ServoConfig powered_drive(int id = 1) {
  emulator::ServoConfig config = servo_config(id);
  config.profile.drive.supply.i_logic = 0.04;
  config.profile.drive.logic = {.v_reset = 5.0, .v_reset_hysteresis = 0.5, .boot_time = 0.05};
  return config;
}

inline emulator::BusConfig powered_bus(std::initializer_list<int> ids, std::int64_t bitrate = 0) {
  emulator::BusConfig config = bus_config(ids, bitrate);
  for (emulator::ServoConfig& servo : config.servos) {
    servo = powered_drive(servo.id);
  }
  return config;
}

}  // namespace lk::test
