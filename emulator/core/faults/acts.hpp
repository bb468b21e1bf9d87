#pragma once

/// @file Arguments of the functions in a fault's row: the drive or frame that the fault acts on.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/bus/link.hpp"
#include "emulator/core/bus/memory.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/core/fault.hpp"
#include "emulator/core/seed.hpp"
#include "emulator/core/servo/servo.hpp"
#include "model/faults.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// A fault on a running bus. Kept after its end, for reports.
struct LiveFault {
  Fault fault;
  FaultEvidence evidence;
  std::size_t order = 0;  // number of faults armed before it
  std::int64_t beginnings = 0;
  SimTime since{0};                   // time of the last beginning
  std::optional<SimTime> sampled_at;  // last sample of its effect
  std::vector<double> anchors;        // rad; output angles of `fault.ids` at the last beginning
  std::uint64_t destroyed = 0;        // number of destroyed frames since the last beginning
  std::uint64_t random = 1;

  const FaultRow& row() const { return *fault.row; }
  bool active() const { return evidence.state == FaultEvidence::State::kActive; }
  bool is_over() const {
    return evidence.state == FaultEvidence::State::kOver ||
           evidence.state == FaultEvidence::State::kCleared;
  }
  bool is_of(int id) const {
    return std::find(fault.ids.begin(), fault.ids.end(), id) != fault.ids.end();
  }
  bool will_recur() const { return fault.every && (fault.times == 0 || beginnings < fault.times); }
  double number(std::size_t n) const { return fault.values[n].number(); }
  template <class Choice>
  Choice choice(std::size_t n) const {
    return fault.values[n].choice<Choice>();
  }
  /// Returns the next random number of this fault, in [0, 1).
  double draw() { return uniform(random = mix(random)); }
  /// Returns true if the fault hits this frame. A fault of probability 1 draws no number.
  bool hits() { return fault.probability >= 1 || draw() < fault.probability; }
  /// Counts an effect at `now` on the drive `id` or kWholeBus, and on `frame` unless it is null.
  void took_effect(SimTime now, int id, const protocol::Frame* frame = nullptr);
};

/// A lasting plant fault, for the motor of one of the affected drives.
struct OnPlant {
  const LiveFault& live;
  const ServoConfig& servo;
  SimTime active;  // time since the fault began

  double number(std::size_t n = 0) const { return live.number(n); }
  template <class Choice>
  Choice choice(std::size_t n) const {
    return live.choice<Choice>(n);
  }
  /// Angle of the output when the fault began, rad.
  double anchor() const;
};

/// A frame on the wire, before the drive receives it.
struct OnQuery {
  enum class Fate : std::uint8_t {
    kDelivered,
    kIgnored,  // by the firmware; other faults still act on the frame
    kLost,
  };
  LiveFault& live;
  const Servo& servo;
  SimTime now;
  protocol::Frame& frame;
  Fate fate = Fate::kDelivered;

  /// The drive listens to frames of this kind, single-drive or multi-drive.
  bool is_listening() const;
  /// The drive would answer the frame. Other frames do not count as lost.
  bool would_be_answered() const;
  void took_effect() { live.took_effect(now, servo.id(), &frame); }
};

/// A reply before it leaves the drive; other faults may have changed it.
struct OnReply {
  LiveFault& live;
  int id;
  SimTime now;
  const DriveLink& link;
  std::vector<Outgoing>& out;
  std::int64_t bitrate;     // 0: frames take no time
  std::uint64_t lost = 0;   // frames that will not leave
  std::uint64_t extra = 0;  // additional frames
  bool stale = false;       // repeats an earlier reply

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
  int sender;  // ID of the drive that sends it; kWholeBus: a host or a duplicate
  std::int64_t bitrate;
  bool serial;  // RS-485
};

/// A drive at the instant of a momentary fault.
struct AtOnce {
  LiveFault& live;
  Servo& servo;
  Lane motor;
  Memory& memory;
  bool alive;
  std::vector<RomWrite>& rom_writes;  // not yet taken; a change of ROM is reported as a write
  bool restart = false;               // the controller has to restart after this
};

/// A drive that may send without a query.
struct OnBabble {
  LiveFault& live;
  const Servo& servo;
  const DriveLink& link;
  SimTime running;  // time since the controller started
};
/// Frame to send, if any, and the pause before the next one.
struct Babble {
  SimTime pause;
  std::optional<protocol::Frame> frame;
};

}  // namespace lk::emulator
