#pragma once

/// @file Private state of DriveBank. Only the sources of DriveBank include this header, because it
/// depends on vector types.

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/control/motion_loops.hpp"
#include "model/control/protection.hpp"
#include "model/drive_bank.hpp"
#include "model/plant/brake.hpp"
#include "model/plant/thermal.hpp"
#include "model/tick.hpp"

namespace lk::model {

struct DriveBank::State {
  /// The part of one drive that is computed outside the fast tick, as scalars.
  struct Unit : DriveInputs {
    MotionParams motion_params;
    MotionState motion;
    ProtectionState protection;
    LifeState life;
    BrakeState brake;
    double supply_drop = 0.0;  // V
    bool mounted = false;      // on a body; inertia faults do not scale the body's J
    bool mounted_stiff = false;
    double mount_offset = 0.0;  // rad: shaft angle minus body angle
    bool slow_sensors_faulty = false;
    SlowSensors slow_sensors{};
    SlowMeasurement slow;
    std::uint64_t slow_noise = 1;
  };
  /// Context of `give_orders`: the bank and the first drive of the block.
  struct BlockDrives {
    State* bank;
    std::size_t begin;
  };

  std::vector<Unit> units;
  TickBlock<double> alone;            // used when there is exactly one drive
  std::vector<TickBlock<Wide>> wide;  // used otherwise, kLanes drives each
  NamedKernel kernel;
  bool edge = false;     // a drive died or came alive in the present stretch
  bool stopped = false;  // the present stretch has to end early
  int stride = 1;        // ticks; greatest common divisor of all `motion_divider`

  State(std::span<const DriveInit> drives, NamedKernel chosen);
  explicit State(std::span<const DriveOf> drives);

  /// Allocates blocks for `count` drives.
  void make_room(std::size_t count);
  /// Puts a drive at rest into each unused lane.
  void fill_spare_lanes();
  /// Appends a copy of a drive of another bank.
  void take_in(const State& other, std::size_t drive);

  /// Calls `access(block, lane)` with the drive's fast state: the scalar block of a bank of one
  /// drive, else a lane of a wide block.
  template <class Access>
  decltype(auto) with_block(std::size_t drive, Access access) {
    assert(drive < units.size());
    return wide.empty() ? access(alone, std::size_t{0})
                        : access(wide[drive / kLanes], drive % kLanes);
  }
  template <class Access>
  decltype(auto) with_block(std::size_t drive, Access access) const {
    assert(drive < units.size());
    return wide.empty() ? access(alone, std::size_t{0})
                        : access(wide[drive / kLanes], drive % kLanes);
  }

  /// State of a drive's joint, at the output, as a mounted body sees it.
  struct Joint {
    double theta, omega;  // rad, rad/s
    double rotor_share;   // weight of the rotor in theta and omega, 0..1; the output has the rest
    double armature;      // kg·m²
  };
  Joint joint(std::size_t drive) const;

  /// Implement the functions of DriveBank with the same names.
  bool advance_to_edge(std::int64_t until, std::size_t drive);
  void restart(std::size_t drive);
  /// Runs brake, controller life and motion loops of a drive. Call every `motion_divider` ticks.
  void run_firmware(std::size_t drive);
  void run_motion_loops(std::size_t drive);
  void die(std::size_t drive);
  /// Returns true if the stretch must end: a drive died or came alive, or a brake moved.
  static bool give_orders(void* block_drives, std::size_t first, std::size_t count,
                          std::int64_t tick);
  /// Returns the supply voltage of the drive with these faults, V.
  static double source_voltage(const Unit& unit, const Faults& faults);
  /// Returns the plant parameters of the drive with these faults.
  static PlantParams<double> plant_of(const Unit& unit, const Faults& faults);
  void derive_plant(std::size_t drive);
  void derive_control(std::size_t drive);
};

}  // namespace lk::model
