#pragma once

/// @file What tests of the core share: replies, supply, motion.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <string_view>
#include <vector>

#include "tests/support/test_bus.hpp"

namespace lk::test {

inline constexpr double kCount_cdeg = 36000.0 / 16384;
// One count from the target, which is up to half a count from one.
inline constexpr double kArrived_cdeg = 1.5 * kCount_cdeg;

/// Returns the replies since the last call.
inline std::vector<emulator::TimedFrame> replies_of(emulator::Bus& bus) {
  std::vector<emulator::TimedFrame> replies;
  bus.take_replies(replies);
  return replies;
}

/// Advances to `until`; returns the replies since the last call.
inline std::vector<emulator::TimedFrame> run_until(emulator::Bus& bus, emulator::SimTime until) {
  bus.advance_to(until);
  return replies_of(bus);
}

/// Returns the ROM writes completed since the last call.
inline std::vector<emulator::RomWrite> rom_writes_of(emulator::Bus& bus) {
  std::vector<emulator::RomWrite> writes;
  bus.take_rom_writes(writes);
  return writes;
}

/// Changes the supply of drive 1 at once, and waits.
inline void supply(Host& host, double voltage_V, emulator::SimTime wait) {
  host.bus.apply({1, emulator::SupplyVoltage{voltage_V, 0ns}});
  host.wait(wait);
}

/// Sends a query for one drive and waits.
inline void send(Host& host, std::string_view query, emulator::SimTime wait) {
  host.ask(query);
  host.wait(wait);
}
inline void send(Host& host, const protocol::Frame& query, emulator::SimTime wait) {
  host.ask(query);
  host.wait(wait);
}

/// Sends several, and waits after the last.
inline void send(Host& host, std::initializer_list<std::string_view> queries,
                 emulator::SimTime wait = 0ns) {
  for (const std::string_view query : queries) host.ask(query);
  host.wait(wait);
}

inline double speed_dps(const Host& host, int id = 1) {
  return host.bus.truth(id).omega_m * 180 / std::numbers::pi;
}

/// Returns the largest current demand of drive 1 within `duration`, sampled every 250 µs.
inline double most_A(Host& host, emulator::SimTime duration = 10ms) {
  double most = 0;
  for (emulator::SimTime t{0}; t < duration; t += 250us) {
    host.wait(250us);
    most = std::max(most, std::abs(host.bus.truth(1).i_q_ref));
  }
  return most;
}

/// Returns the shaft's angle after the motion, in 0.01°.
inline double rest_cdeg(Host& host) {
  host.wait(2s);
  return static_cast<double>(host.multi_turn_cdeg());
}

inline protocol::Frame query(const protocol::Command& command) {
  return protocol::encode_query(1, command, protocol::kLegacyFormat);
}

}  // namespace lk::test
