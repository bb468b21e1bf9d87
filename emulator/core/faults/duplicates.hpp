#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "emulator/core/faults/fault_board.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/wire/wire.hpp"
#include "model/drive_bank.hpp"

namespace lk::emulator {

/// A duplicate's answer starts so much later than the drive's: two crystals and two interrupts
/// never agree to a bit (assumed). On a real bus both may still start together, when the wire was
/// taken as they got ready, and destroy each other until one gives up; here they follow each other.
inline constexpr SimTime kDuplicateLag = std::chrono::microseconds(5);

/// Second drives with the ID of another, there because of a fault. Each has the supply that the
/// drive was configured with; what happens to the drive's own does not reach it, nor do other
/// faults. A value.
class Duplicates {
 public:
  /// Owners of frames from here on are duplicates'. The low six bits are the ID, as those of every
  /// identifier of a drive.
  static constexpr std::uint32_t kFirstOwner = 0x10000;
  /// Owners repeat after so many faults, far more than a bus keeps.
  static constexpr std::uint32_t kOwners = 1U << 20;

  bool empty() const { return drives_.empty(); }
  /// The fault `fault` of `faults` has begun on `original`, whose motor has this PWM rate.
  void add(const FaultBoard& faults, std::size_t fault, const Servo& original,
           std::int64_t f_pwm_Hz, SimTime now);
  /// The fault is over. Returns how many frames are lost with its drives.
  std::size_t remove(std::size_t fault, Wire& wire, SimTime now);
  void advance_to(SimTime t);
  /// A query's last bit is on the wire at `at`. Returns how many answers this brings forth.
  std::size_t hear(SimTime at, const protocol::Frame& frame, Wire& wire, FaultBoard& faults,
                   SimTime now);
  /// The transmit error counter of the owner of a frame.
  int& errors(std::uint32_t owner);

 private:
  struct Drive {
    std::size_t fault;
    std::uint32_t owner;  // of its frames
    std::int64_t f_pwm_Hz;
    std::int64_t first_tick;  // of the bus, at which its own clock began
    model::DriveBank motor;
    Servo servo;
    int errors = 0;
    SimTime last_reply{0};
  };
  std::vector<Drive> drives_;
};

}  // namespace lk::emulator
