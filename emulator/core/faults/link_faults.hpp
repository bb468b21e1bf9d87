#pragma once

/// @file What faults of the link do to frames, and what they need to remember: plain values.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "emulator/core/faults/live_fault.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/sim_time.hpp"
#include "model/drive_bank.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

// Error counters of a CAN controller (ISO 11898-1, fault confinement).
inline constexpr int kErrorStep = 8;       // for each frame of its own that is destroyed
inline constexpr int kErrorWarning = 96;   // where drivers begin to warn
inline constexpr int kErrorPassive = 128;  // it lets others go first
inline constexpr int kBusOff = 256;        // it leaves the bus

/// The choice of the parameter "frames": what is said, what is heard, or both.
enum class FrameChoice : std::uint8_t { kReplies, kQueries, kBoth };

/// A frame on its way out of a drive.
struct Outgoing {
  SimTime ready{0};
  protocol::Frame frame;
  std::uint64_t after_rom_write = 0;  // a copy acknowledges what its original does
  bool held_back = false;             // until the next one has left
};

/// The controller of a drive, between firmware and wire.
struct DriveLink {
  int errors = 0;        // transmit error counter
  bool bus_off = false;  // neither sends nor hears
  bool blocked = false;  // nothing leaves its queue
  std::optional<Outgoing> held_back;
  std::optional<Outgoing> last_said;  // what stands in its buffer
};

/// The controller of the hosts' adapter.
struct HostLink {
  int transmit_errors = 0;
  int receive_errors = 0;
};

/// A second drive with the ID of another, there because of a fault. It has the supply that the
/// drive was configured with; what happens to the drive's own does not reach it, nor do other
/// faults.
struct DuplicateDrive {
  std::size_t fault;
  std::size_t index;
  std::uint32_t owner;  // of its frames
  std::int64_t f_pwm_Hz;
  std::int64_t first_tick;  // of the bus, at which its own clock began
  model::DriveBank motor;
  Servo servo;
  int errors = 0;
  SimTime last_reply{0};
};

/// A duplicate's answer starts so much later than the drive's: two crystals and two interrupts
/// never agree to a bit (assumed). On a real bus both may still start together, when the wire was
/// taken as they got ready, and destroy each other until one gives up; here they follow each other.
inline constexpr SimTime kDuplicateLag = std::chrono::microseconds(5);

/// Of the ID and the fault; its low six bits are the ID, as those of every identifier of a drive.
constexpr std::uint32_t duplicate_owner(std::size_t fault, int id) {
  return 0x10000U + static_cast<std::uint32_t>(fault) * 64U + static_cast<std::uint32_t>(id);
}

SimTime from_ms(double time_ms);

/// Whether a fault with the choice `frames` acts on these.
bool acts_on(const LiveFault& live, std::size_t parameter, FrameChoice frames);

/// Flips so many different bits of the data, all when there are no more.
void flip_bits(LiveFault& live, int bits, protocol::Frame& frame);

/// What a host's adapter reports of a destroyed frame, as SocketCAN has it (linux/can/error.h): a
/// bus error, its own counters, and the states that these reach. `sending`: the frame was a host's.
/// The state of a drive's controller is nowhere on the wire: a host sees its bus errors and then
/// its silence.
protocol::Frame report_error(HostLink& host, bool sending);
/// A frame got through.
void count_success(HostLink& host, bool sending);

}  // namespace lk::emulator
