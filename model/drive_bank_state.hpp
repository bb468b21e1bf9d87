#pragma once

/// @file What a DriveBank keeps, for its own sources only: the blocks of the fast tick, and with
/// them vector registers.

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/control/life.hpp"
#include "model/control/motion_loops.hpp"
#include "model/control/protection.hpp"
#include "model/drive_bank.hpp"
#include "model/plant/brake.hpp"
#include "model/plant/slow_sensors.hpp"
#include "model/tick.hpp"

namespace lk::model {

struct DriveBank::State {
  /// The slow, scalar part of one drive.
  struct Unit {
    DriveParams params;
    ControlSettings settings;
    MotionParams motion_params;
    MotionState motion;
    ProtectionState protection;
    LifeState life;
    BrakeState brake;
    bool connected = true;
    bool mounted = false;  // on a body, which faults of the drive do not make heavier
    bool mounted_stiff = false;
    double mounted_at = 0.0;  // rad: the shaft's angle, less the body's
    Faults faults;
    bool slow_sensors_faulty = false;
    Setpoint setpoint = Idle{};
    SlowSensors slow_sensors{};
    SlowMeasurement slow;
    std::uint64_t slow_noise = 1;
  };
  /// The drives of one block, as the tick sees them from inside a stretch.
  struct BlockDrives {
    State* bank;
    std::size_t begin;
  };

  std::vector<Unit> units;
  TickBlock<double> alone;            // used when there is exactly one drive
  std::vector<TickBlock<Wide>> wide;  // used otherwise, kLanes drives each
  NamedKernel kernel;
  bool edge = false;     // of the stretch under way: a drive died or came alive,
  bool stopped = false;  // or it had to end for some reason
  int stride = 1;        // ticks between instants at which some motion loop may run

  State(std::span<const DriveInit> drives, NamedKernel chosen);
  explicit State(std::span<const DriveOf> drives);

  /// Room for the fast states of so many drives.
  void make_room(std::size_t count);
  /// What lanes without a drive hold.
  void fill_spare_lanes();
  /// A drive of another bank becomes the next one of this.
  void take_in(const State& other, std::size_t drive);

  /// Where a drive's fast state lives: the scalar block when it is alone, else a lane of a wide
  /// one.
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

  /// What of a drive a body has at its joint, at the output.
  struct Joint {
    double theta, omega;  // rad, rad/s
    double rotor_share;   // of the rotor in these, 0 to 1; the rest is the output's
    double armature;      // kg·m²
  };
  Joint joint(std::size_t drive) const;

  /// DriveBank's of the same names.
  bool advance_to_edge(std::int64_t until, std::size_t drive);
  void restart(std::size_t drive);
  /// What the drive does once every few ticks.
  void run_firmware(std::size_t drive);
  void run_motion_loops(std::size_t drive);
  void die(std::size_t drive);
  /// Returns true if the stretch must end: a drive died or came alive, or a brake moved.
  static bool give_orders(void* block_drives, std::size_t first, std::size_t count,
                          std::int64_t tick);
  /// The plant of a drive as it would be with these faults.
  static PlantParams<double> plant_of(const Unit& unit, const Faults& faults);
  void derive_plant(std::size_t drive);
  void derive_control(std::size_t drive);
};

}  // namespace lk::model
