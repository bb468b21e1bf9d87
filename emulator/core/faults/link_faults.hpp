#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "emulator/core/bus/link.hpp"
#include "emulator/core/bus/wire.hpp"
#include "emulator/core/faults/fault_board.hpp"
#include "emulator/core/servo/servo.hpp"
#include "model/drive_bank.hpp"

namespace lk::emulator {

/// Delay of a duplicate's answer after the drive's answer: crystals and interrupts of two drives
/// never agree to a bit (assumed). On a real bus both answers may start together after a busy wire,
/// and destroy each other until one drive gives up. Here one answer follows the other.
inline constexpr SimTime kDuplicateLag = std::chrono::microseconds(5);

/// Duplicates: second drives with the ID of an original drive, made by a fault. Each has its own
/// supply, as configured for the original. Later changes of the original's supply and other faults
/// do not affect it. Copies are independent.
class Duplicates {
 public:
  /// Lowest frame owner of a duplicate. The low six bits of an owner are the configured ID.
  static constexpr std::uint32_t kFirstOwner = 0x10000;
  /// Number of faults after which owners repeat: far more faults than a bus keeps.
  static constexpr std::uint32_t kOwners = 1U << 20;

  bool empty() const { return drives_.empty(); }
  /// Adds a duplicate of `original`, whose motor has this PWM rate, for a fault that has begun.
  void add(const FaultBoard& faults, std::size_t fault, const Servo& original,
           std::int64_t f_pwm_Hz, SimTime now);
  /// Removes the duplicates of a fault. Returns the number of frames lost with them.
  std::size_t remove(std::size_t fault, Wire& wire, SimTime now);
  void advance_to(SimTime t);
  /// Processes a frame whose last bit was at `at`. Returns the number of answers.
  std::size_t process(SimTime at, const protocol::Frame& frame, Wire& wire, FaultBoard& faults,
                      SimTime now);
  /// Transmit error counter of the owner of a frame.
  int& errors(std::uint32_t owner);

 private:
  struct Drive {
    std::size_t fault;
    DriveLink link;
    std::int64_t f_pwm_Hz;
    std::int64_t first_tick;  // tick, counted from the bus's time 0, that is tick 0 of `motor`
    model::DriveBank motor;
    Servo servo;
  };
  std::vector<Drive> drives_;
};

}  // namespace lk::emulator
