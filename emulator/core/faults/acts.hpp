#pragma once

/// @file What the functions of a fault's row are given: a drive, or a frame, as the fault meets it.

#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/faults/live_fault.hpp"
#include "emulator/core/node/link.hpp"
#include "emulator/core/node/memory.hpp"
#include "emulator/core/servo/servo.hpp"
#include "model/faults.hpp"

namespace lk::emulator {

/// A lasting fault and the motor of one of its drives.
struct OnPlant {
  const LiveFault& live;
  const ServoConfig& servo;
  SimTime active;  // since it began

  double number(std::size_t n = 0) const { return live.number(n); }
  template <class Choice>
  Choice choice(std::size_t n) const {
    return live.choice<Choice>(n);
  }
  /// Where the output stood when it began, rad.
  double anchor() const;
};

/// A frame on the wire, before the drive hears it.
struct OnQuery {
  enum class Fate : std::uint8_t {
    kHeard,
    kIgnored,  // by the firmware; other faults act on it all the same
    kLost,
  };
  LiveFault& live;
  const Servo& servo;
  SimTime now;
  protocol::Frame& frame;
  Fate fate = Fate::kHeard;

  /// Frames of this kind, for one drive or for several, are for this drive.
  bool is_listening() const;
  /// What the drive would not have answered anyway cannot be lost.
  bool would_be_answered() const;
  void took_effect() { live.took_effect(now, servo.id(), &frame); }
};

/// What a drive is about to say: its reply, or what other faults have made of it.
struct OnReply {
  LiveFault& live;
  int id;
  SimTime now;
  const DriveLink& link;
  std::vector<Outgoing>& out;
  std::int64_t bitrate;     // 0: frames take no time
  std::uint64_t lost = 0;   // frames that were to leave
  std::uint64_t extra = 0;  // frames that were not
  bool stale = false;       // it says what it said before

  void took_effect(const Outgoing& one) { live.took_effect(now, id, &one.frame); }
};

/// A frame on its way from the wire to the host.
struct OnRead {
  LiveFault& live;
  SimTime now;
  protocol::Frame& frame;

  void took_effect() { live.took_effect(now, kWholeBus, &frame); }
};

/// A frame whose last bit is due.
struct OnWire {
  LiveFault& live;
  int sender;  // the drive, or kWholeBus
  std::int64_t bitrate;
  bool serial;  // RS-485
};

/// A drive at the instant at which something is done to it.
struct AtOnce {
  LiveFault& live;
  Servo& servo;
  Lane motor;
  Memory& memory;
  bool alive;
  std::vector<RomWrite>& rom_writes;  // not yet taken; a change of ROM is told like a write
  bool restart = false;               // the controller is to start anew after this
};

/// A drive that may talk now without being asked.
struct OnBabble {
  LiveFault& live;
  const Servo& servo;
  const DriveLink& link;
  SimTime running;  // since its controller started
};
/// What it says, if anything, and when it may again.
struct Babble {
  SimTime pause;
  std::optional<protocol::Frame> frame;
};

}  // namespace lk::emulator
