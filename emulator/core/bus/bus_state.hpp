#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "emulator/core/bus/agenda.hpp"
#include "emulator/core/bus/conditions.hpp"
#include "emulator/core/bus/host_adapter.hpp"
#include "emulator/core/bus/host_side.hpp"
#include "emulator/core/bus/motors.hpp"
#include "emulator/core/bus/node.hpp"
#include "emulator/core/bus/wire.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/core/bus_stats.hpp"
#include "emulator/core/faults/fault_board.hpp"
#include "emulator/core/faults/link_faults.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Supply, ambient and load of a drive as last set, without faults.
struct DriveConditions {
  bool power = true;
  double supply_V = 0;
  double ambient_C = 0;
  model::LoadParams load;
};

/// Interval at which conditions and lasting faults of the plant are sampled.
inline constexpr SimTime kSamplePeriod = std::chrono::milliseconds(1);

/// Full state of a bus. Copies are independent. Functions with an ID throw std::out_of_range if the
/// drive is not on the bus.
struct BusState {
  explicit BusState(const BusConfig& config);

  /// No motor lags behind `time`.
  bool settled() const { return motors_at == time; }
  Lane lane(const Node& node) { return motors.lane(node.motor); }

  // Pre: settled().
  const Servo& servo(int id) const;
  model::Telemetry telemetry(int id) const;
  model::Truth truth(int id) const;
  DriveView view(int id) const;
  DriveConditions drive_conditions(int id) const;
  /// Set point of the control loops.
  model::Setpoint setpoint(int id) const;
  /// Energy taken from the source since power-up.
  double drawn_J(int id) const;
  /// Pre: the drive is mounted on a body.
  model::MountedShaft mounted_shaft(int id) const;
  BusStats stats() const;

  // Setters. They take effect at once.
  void set_supply_drop(int id, double drop_V) { lane(nodes.of(id)).set_supply_drop(drop_V); }
  /// Sets the state of the drive's joint in the body.
  void mount(int id, const model::Mount& mount, const JointState& joint);

  /// Hosts have an adapter, or had one: a frame of a host then advances the bus to the frame's
  /// time.
  bool adapted() const { return faults.any_of_adapter() || adapter.in_use(); }
  /// A fault keeps replies in the drives.
  bool replies_are_held() const {
    return faults.any(&FaultRow::blocks) || faults.any(&FaultRow::holds_back);
  }
  /// No host sends, and no drive has a pending reply.
  bool line_is_quiet() const {
    return wire([](auto& on) { return on.host_queue_size() == 0 && on.drive_frames() == 0; });
  }
  /// Some fault or condition may read any drive.
  bool faults_or_conditions() const { return faults.any_active() || !conditions.empty(); }

  SimTime time{0};
  SimTime motors_at{0};  // all motors have reached at least this time
  SimTime waits_for{0};  // time that shared motors have to reach
  Wire wire;
  std::optional<SerialConfig> serial;
  std::uint64_t seed;
  Motors motors;
  Nodes nodes;
  HostSide host;
  AdapterTimes own_adapter;  // as configured, without faults
  HostAdapter adapter;
  bool had_errors = false;  // a frame has been destroyed: error counters may be above 0
  int flags_left = 0;       // sum of Node::flags_left
  Agenda agenda;
  Conditions conditions;
  FaultBoard faults;
  Duplicates duplicates;
  std::vector<TimedFrame> replies;                  // received by hosts, not yet taken
  std::vector<RomWrite> rom_writes;                 // not yet taken
  std::vector<BodyAct> body_acts;                   // not yet taken
  BodyState body;                                   // of the body that drives of the bus move
  std::shared_ptr<const BodySignals> body_signals;  // keeps the signals of conditions valid
  BusStats own_stats;                               // without the sums over drives, see stats()
};

}  // namespace lk::emulator
