#pragma once

/// @file Random but repeatable host frames and events for 32 drives, for tests.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <span>
#include <utility>

#include "emulator/core/directive.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "protocol/opcodes.hpp"

namespace lk::test {

using emulator::SimTime;

/// Draws frames, directives and faults, valid and invalid, over the whole permitted range.
class RandomInputs {
 public:
  /// Each fault lasts at most `longest_fault`.
  RandomInputs(std::uint32_t seed, int drives, SimTime longest_fault)
      : random_(seed), drives_(drives), longest_fault_(longest_fault) {}

  bool one_in(unsigned n) { return below(n) == 0; }
  int below(unsigned n) { return static_cast<int>(random_() % n); }
  /// Returns a number in [0, 1).
  double share() { return static_cast<double>(random_() >> 5U) / 134'217'728.0; }
  double between(double low, double high) { return low + (high - low) * share(); }
  SimTime up_to(SimTime most) {
    return SimTime(static_cast<std::int64_t>(share() * static_cast<double>(most.count())));
  }
  int drive() { return 1 + below(static_cast<unsigned>(drives_)); }

  /// Returns a frame for one or several drives; sometimes an invalid one.
  protocol::Frame frame() {
    protocol::Frame frame;
    for (auto& byte : std::span(frame.data).first(protocol::kCanBytes))
      byte = static_cast<std::uint8_t>(random_());
    if (one_in(2)) std::fill(frame.data.begin() + 1, frame.data.end(), std::uint8_t{0});
    frame.id = protocol::kSingleDriveId + static_cast<std::uint32_t>(drive());
    const auto command =
        static_cast<std::size_t>(below(static_cast<unsigned>(protocol::commands().size())));
    frame.data[0] = static_cast<std::uint8_t>(protocol::commands()[command].opcode);
    if (one_in(200)) {
      const auto row = static_cast<std::size_t>(
          below(static_cast<unsigned>(protocol::multi_drive_commands().size())));
      frame.id = protocol::multi_drive_commands()[row].identifier;
    } else if (one_in(20)) {
      spoil(frame);
    }
    return frame;
  }

  /// Returns a directive for one drive, or the end of a fault.
  emulator::Directive directive() {
    using namespace emulator;
    using namespace std::chrono_literals;
    const int id = drive();
    const int kind = below(24);
    if (kind < 1) return {id, PowerOff{}};
    if (kind < 3) return {id, PowerCycle{up_to(2s)}};
    if (kind < 5) {
      return {id, SupplyVoltage{one_in(4) ? between(0, 100) : between(18, 30), up_to(1s)}};
    }
    if (kind < 6) return {id, Sag{between(0, 24), up_to(500ms)}};
    if (kind < 7) return {id, AmbientTemperature{between(-40, 125)}};
    if (kind < 10) return {id, Load{load()}};
    if (kind < 11) return {id, TurnShaft{between(-1e4, 1e4)}};
    if (kind < 15) return {id, setting()};
    if (kind < 16) return {kWholeBus, ClearFault{std::string(any_row().word)}};
    return {id, PowerOn{}};
  }

  emulator::Fault fault() {
    const emulator::FaultRow& row = any_row();
    emulator::Fault fault = emulator::fault_of(row);
    for (std::size_t n = 0; n < row.params.size(); ++n) fault.values[n] = value(row.params[n]);
    if (row.per_frame) fault.probability = one_in(2) ? 1 : share();
    if (!row.momentary()) {
      // Short, because a second drive with an ID needs its own motor model, and a fault of the
      // whole bus blocks most traffic.
      const bool dear = row.word == "duplicate_id" || row.of_bus;
      fault.duration = up_to(dear ? longest_fault_ / 10 : longest_fault_) + SimTime{1};
    }
    if (one_in(8)) {
      fault.every = std::max(fault.duration.value_or(SimTime{0}), emulator::kMinFaultPeriod) +
                    up_to(5 * longest_fault_) + SimTime{1};
      fault.times = 1 + below(20);
    }
    if (!row.of_bus) {
      const int first = drive();
      for (int id = first; id <= std::min(first + below(3), drives_); ++id) {
        fault.ids.push_back(id);
      }
    }
    return fault;
  }

 private:
  /// Makes the frame invalid, so that no drive answers.
  void spoil(protocol::Frame& frame) {
    using protocol::FrameKind;
    const int kind = below(7);
    if (kind == 0) frame.dlc = static_cast<std::uint8_t>(below(8));
    if (kind == 1) frame.id = static_cast<std::uint32_t>(below(0x800));
    if (kind == 2) frame.extended = true;
    if (kind == 3) frame.kind = FrameKind::kRemote;
    if (kind == 4) frame.kind = FrameKind::kFd;
    if (kind == 5) frame.kind = FrameKind::kError;
    if (kind == 6) frame.data[0] = static_cast<std::uint8_t>(below(256));
  }

  model::LoadParams load() {
    model::LoadParams load;
    load.J = between(0, 0.02);
    load.tau = between(-5, 5);
    load.tau_gravity = between(0, 5);
    if (one_in(4)) load.theta_min = -between(0, 100);
    if (one_in(4)) load.theta_max = between(0, 100);
    return load;
  }

  emulator::Setting setting() {
    using enum emulator::RomParameter;
    // kDriverId: its own ID again.
    constexpr std::array kParameters{kGains,       kAcceleration,  kMaxTorqueCurrent,
                                     kMaxPower,    kMaxSpeed,      kMaxAngle,
                                     kCurrentRamp, kBroadcastMode, kDriverId};
    emulator::Setting setting;
    setting.parameter = kParameters[static_cast<std::size_t>(below(kParameters.size()))];
    emulator::Registers& value = setting.value;
    for (std::uint16_t* gain : {&value.gains.angle_kp, &value.gains.speed_kp}) {
      *gain = static_cast<std::uint16_t>(below(256));
    }
    value.acceleration_dps_s = below(1'000'000);
    value.max_torque_current_lsb = below(2001);
    value.max_power_permille = below(851);
    value.max_speed_dps = between(1, 1e5);
    value.max_angle_deg = one_in(2) ? 0 : between(0, 1e4);
    value.current_ramp_A_s = one_in(2) ? 0 : between(0, 1e3);
    value.broadcast_mode = one_in(4);
    return setting;
  }

  const emulator::FaultRow& any_row() {
    return emulator::fault_table()[static_cast<std::size_t>(
        below(static_cast<unsigned>(emulator::fault_table().size())))];
  }

  emulator::FaultValue value(const emulator::FaultParam& parameter) {
    if (!parameter.choices.empty()) {
      return static_cast<emulator::FaultChoice>(
          below(static_cast<unsigned>(parameter.choices.size())));
    }
    if (!parameter.required && one_in(4)) return parameter.fallback;
    if (parameter.word == "new_id") return 1.0 + below(static_cast<unsigned>(drives_));
    // While frames wait in a host's adapter, the bus is silent.
    if (parameter.word == "stall_ms") return between(parameter.min, 20);
    if (parameter.word == "tx_us" || parameter.word == "tail_us") return between(0, 20'000);
    // Mostly realistic values, sometimes the permitted extremes.
    const double value = between(parameter.min, parameter.max);
    const double fit = one_in(4) ? value : std::clamp(value / 1000, parameter.min, parameter.max);
    return parameter.whole ? std::ceil(fit) : fit;
  }

  std::mt19937 random_;
  int drives_;
  SimTime longest_fault_;
};

}  // namespace lk::test
