#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/files/rom_store.hpp"
#include "emulator/io/live/pacer.hpp"
#include "emulator/io/transports/netlink.hpp"
#include "emulator/io/transports/port.hpp"
#include "emulator/monitor/advice/adviser.hpp"
#include "protocol/opcodes.hpp"

namespace lk::emulator {

/// Returns the time at which a bus that has reached `reached` receives a host's frame of time `at`.
/// It is the later of the two, rounded up to a microsecond, the resolution of a log.
SimTime frame_instant(SimTime at, SimTime reached);

/// Callbacks for an observer of a bus. The line calls `sample` at each time `next_due`
/// (sampler.hpp).
struct Watcher {
  std::function<SimTime()> next_due;
  std::function<void(const Bus&)> sample;
};

/// Callbacks for the traffic of a line. Functions may be empty.
struct Listener {
  std::function<void(const TimedFrame&)> query;  // a host's frame; `at`: when the bus gets it
  // A drive's frame, or the echo of a host's, once it has left the wire.
  std::function<void(const TimedFrame&)> reply;
  // Directives as JSON; called before the bus executes them.
  std::function<void(SimTime now, const std::string& json)> directive;
  // A write to the ROM of drive `id` failed on disk: the ROM holds these earlier values again.
  std::function<void(SimTime now, int id, const RomGate::Kept&)> restored_rom;
};

/// One bus with its port and its observers. `accept` gives the bus a host's frame. `advance_to`
/// advances time and sends replies through the port. Tests use lines without a port.
class Line {
 public:
  /// Limit of frames queued while time stands still.
  static constexpr std::size_t kMaxBacklog = 1'000'000;
  /// Most frames that wait for a quiet line (assumed: one query every 10 ms for 0.6 s). A host that
  /// sent more does not wait for replies: its frames only wait for room on the bus.
  static constexpr std::size_t kMaxSpaced = 64;

  explicit Line(const BusConfig& config);

  /// Creates the port. Throws StartError.
  void connect(boost::asio::io_context& loop, Interfaces allowed, std::function<void()> on_frames);

  const BusConfig& config() const { return config_; }
  const std::string& name() const { return config_.interface; }
  const std::string& ids() const { return ids_; }  // IDs of the configured drives: "1-4,7"
  const Bus& bus() const { return bus_; }
  Port* port() const { return port_.get(); }
  const RomGate& gate() const { return gate_; }
  bool is_up() const { return !port_ || port_->is_up(); }

  /// Gives the bus a host's frame that arrived at `in.at`, or queues it after a slip.
  void accept(const TimedFrame& in);
  /// As `accept`, for a sender that waits for replies: on RS-485 the frame waits until the line is
  /// quiet. Pre: backlog() < kMaxSpaced.
  void accept_in_turn(const TimedFrame& in);
  /// Call after a slip of simulated time: the frames that hosts sent during it arrive together. On
  /// RS-485 each of them waits until the line is quiet, so as not to collide with the last reply.
  void note_slip();
  /// Queues a host's frame until the bus reaches its time.
  void enqueue(const TimedFrame& in);
  enum class Progress : std::uint8_t {
    kReached,
    kOutOfTime,  // `deadline` came first
    kBlocked,    // too many replies are unsent (WaitPolicy::kForReplies)
  };
  /// Whether time waits when the port cannot send replies as fast as drives give them. A clock that
  /// follows real time does not wait: late replies are lost, as on a robot.
  enum class WaitPolicy : std::uint8_t { kNone, kForReplies };
  /// Advances the bus to `until`, or as far as it gets before `deadline`. With kReached, all events
  /// up to and including `until` have happened, watchers were called, and replies were sent.
  Progress advance_to(SimTime until, MonoTime deadline, WaitPolicy policy);
  /// As `advance_to`, but events at `due` itself remain pending (Bus::reach): the body of the
  /// line's drives does its step first.
  Progress reach(SimTime due, MonoTime deadline, WaitPolicy policy);
  /// The bus, for the code that couples its drives to a body.
  Bus& bus_on_body() { return bus_; }
  /// Notifies listeners of directives. Call before `perform`.
  void announce(const std::string& json) const;
  /// Executes a directive that is due, or plans it. Returns false, without effect, if the bus has
  /// no room for it.
  bool perform(const TimedDirective& directive);

  /// Returns true if no reply waits for the disk or the port.
  bool replies_have_left() const;
  /// Frames of this drive that left the wire while the interface was up.
  std::uint64_t sent(int id) const { return sent_[static_cast<std::size_t>(id)]; }

  /// Finds mistakes of hosts on this bus.
  const Adviser& adviser() const { return adviser_; }
  /// Called when the address (ID, bus or bit rate) of a drive has changed.
  std::function<void()> on_address_change;
  /// Called once with each new advice.
  std::function<void(const Advice&)> on_advice;

  /// Called with each write to ROM. Empty: the write counts as saved at once.
  std::function<void(const RomWrite&)> on_rom_write;
  /// Reports the result of a write to ROM: 0, or the errno of the disk.
  void settle_rom(const RomWrite& write, int error);

  /// Observers of the line. Its callbacks must not remove any of them.
  std::list<Watcher> watchers;
  std::list<Listener> listeners;
  using WatcherKey = std::list<Watcher>::iterator;
  using ListenerKey = std::list<Listener>::iterator;
  /// Returns true if an observer needs events without delay.
  bool watched() const { return !watchers.empty() || !listeners.empty(); }

  /// Number of frames that hosts can send before their adapter refuses one.
  std::size_t room() const;
  std::size_t backlog() const { return backlog_.size(); }
  std::uint64_t backlog_lost() const { return backlog_lost_; }

 private:
  void put_on_bus(const TimedFrame& in);
  void take_from_backlog();
  /// Returns true if queued frames have to wait for room on the bus, or for a quiet line.
  bool backlog_waits() const;
  /// Advances to `until`, calls watchers, and sends replies that are due.
  void advance_watched(SimTime until);
  void send_replies();
  void send_leaving();

  BusConfig config_;
  std::string ids_;
  Bus bus_;
  RomGate gate_;
  Adviser adviser_;
  bool terminal_advised_ = false;  // advice on a host's terminal that is not raw was given
  std::size_t advice_reported_ = 0;
  std::unique_ptr<Port> port_;
  std::deque<TimedFrame> backlog_;  // frames for the bus: time stands still, or the bus has no room
  bool waits_for_quiet_line_ = false;  // frames wait until the line is quiet (RS-485)
  SimTime waits_at_least_until_{0};    // earliest end of this wait
  bool flooded_ = false;               // too many frames to space them: they wait only for room
  bool reported_no_ack_ = false;       // frames of hosts were not acknowledged
  bool advancing_ = false;             // watchers are running; they may call `accept`
  std::uint64_t address_changes_ = 0;  // address changes of the bus at the last check
  std::uint64_t backlog_lost_ = 0;
  std::array<std::uint64_t, protocol::kMaxId + 1> sent_{};  // by drive
  std::map<int, std::uint64_t> refused_;                    // failed ROM writes in a row; by drive
  std::vector<TimedFrame> replies_;  // these three are members to reuse their memory
  std::vector<RomWrite> rom_writes_;
  std::vector<protocol::Frame> leaving_;
};

}  // namespace lk::emulator
