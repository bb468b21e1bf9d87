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

#include "emulator/advice/adviser.hpp"
#include "emulator/core/bus/bus.hpp"
#include "emulator/live/pacer.hpp"
#include "emulator/rom/rom_gate.hpp"
#include "emulator/transports/netlink.hpp"
#include "emulator/transports/port.hpp"
#include "emulator/transports/socketcan.hpp"
#include "protocol/opcodes.hpp"

namespace lk::emulator {

/// When a host's frame that came at `at` counts as put on a bus that is at `reached`: not in the
/// past, and at a whole microsecond, which is what a log can say.
SimTime frame_instant(SimTime at, SimTime reached);

/// Looks at a bus whenever it is due (sampler.hpp).
struct Watcher {
  std::function<SimTime()> next_due;
  std::function<void(const Bus&)> look;
};

/// Hears what goes over a line. Functions may be left out.
struct Listener {
  std::function<void(const TimedFrame&)> query;  // a host's frame; `at`: when the bus takes it in
  std::function<void(const TimedFrame&)> reply;  // when it has left the wire
  // A request in the words of directives has come, as JSON; it is done next.
  std::function<void(SimTime now, const std::string& json)> directive;
  // The disk refused what a drive wrote: its ROM holds this again.
  std::function<void(SimTime now, int id, const RomGate::Kept&)> restored_rom;
};

/// One bus on its interface, and whoever watches it. Frames go in by `take_in`, time goes on by
/// `bring_to`, and replies leave by the port on the way. Without a port there is no interface: what
/// a test has.
class Line {
 public:
  /// Frames kept while time stands still.
  static constexpr std::size_t kMostBacklog = 1'000'000;

  explicit Line(const BusConfig& config);
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  ~Line() = default;

  /// To its port. Throws StartError.
  void connect(boost::asio::io_context& loop, Interfaces allowed, std::function<void()> on_frames);

  const BusConfig& config() const { return config_; }
  const std::string& name() const { return config_.interface; }
  const std::string& ids() const { return ids_; }  // "1-4,7"
  const Bus& bus() const { return bus_; }
  Port* port() { return port_.get(); }
  const Port* port() const { return port_.get(); }
  const RomGate& gate() const { return gate_; }
  bool is_up() const { return !port_ || port_->is_up(); }

  /// A host's frame that arrived at `at`.
  void take_in(const TimedFrame& in);
  /// Simulated time has slipped: frames that hosts sent meanwhile are taken in at once. On RS-485
  /// each of them waits until the line is quiet, as hosts do: it would spoil the reply before.
  void note_slip();
  /// The same, while time stands still.
  void keep_for_later(const TimedFrame& in);
  enum class Progress : std::uint8_t {
    kThere,
    kOutOfTime,  // `deadline` came first
    kBlocked,    // replies have to leave first
  };
  /// Whether time waits when replies cannot leave as fast as they come. Where time follows the
  /// clock it does not: what is over is lost, as on a robot.
  enum class Patience : std::uint8_t { kNone, kForReplies };
  /// Brings the bus to `until`, as far as it gets before `deadline`. Everything that is due up to
  /// and including `until` has happened then, watchers have looked, replies have left.
  Progress bring_to(SimTime until, MonoTime deadline, Patience patience);
  /// The same for the body that drives of the line are on: everything before `due` has happened
  /// (Bus::reach).
  Progress reach(SimTime due, MonoTime deadline, Patience patience);
  /// For whoever moves that body.
  Bus& bus_on_body() { return bus_; }
  /// Tells those who listen what is about to be performed.
  void announce(const std::string& json) const;
  /// Does it now, or plans it. Returns false when the bus has no room for it: nothing is done then.
  bool perform(const TimedDirective& directive);

  /// Everything that was to leave has left.
  bool replies_have_left() const;
  /// Frames of this drive that have left the wire while the interface was up.
  std::uint64_t sent(int id) const { return sent_[static_cast<std::size_t>(id)]; }

  /// What hosts do wrong on this bus.
  const Adviser& adviser() const { return adviser_; }
  /// What is called when some drive has come to be found elsewhere.
  std::function<void()> on_move;
  /// What is called with each advice when it is first given.
  std::function<void(const Advice&)> on_advice;

  /// What is called with each write to ROM; none: it counts as kept at once.
  std::function<void(const RomWrite&)> on_rom_write;
  /// The disk has answered; `error` is 0 or errno.
  void settle_rom(const RomWrite& write, int error);

  /// Kept until they are removed; may not be while the line calls them.
  using WatcherKey = std::list<Watcher>::iterator;
  WatcherKey add_watcher(Watcher watcher) {
    return watchers_.insert(watchers_.end(), std::move(watcher));
  }
  void remove_watcher(WatcherKey watcher) { watchers_.erase(watcher); }
  using ListenerKey = std::list<Listener>::iterator;
  ListenerKey add_listener(Listener listener) {
    return listeners_.insert(listeners_.end(), std::move(listener));
  }
  void remove_listener(ListenerKey listener) { listeners_.erase(listener); }
  /// Somebody wants to see what goes on when it goes on.
  bool watched() const { return !watchers_.empty() || !listeners_.empty(); }

  std::size_t backlog() const { return backlog_.size(); }
  std::uint64_t backlog_lost() const { return backlog_lost_; }

 private:
  void put_on_bus(const TimedFrame& in);
  void take_from_backlog();
  /// The backlog waits for the wire.
  bool backlog_waits() const;
  /// To `until`, watched; what was to leave on the way leaves.
  void advance_to(SimTime until);
  void keep_rom();
  void tell_of_rom(int id, int error);
  void look_after_hosts();
  void send_replies();
  void send(const std::vector<protocol::Frame>& frames);
  bool crowded() const;

  BusConfig config_;
  std::string ids_;
  Bus bus_;
  RomGate gate_;
  Adviser adviser_;
  bool told_terminal_ = false;  // that the host's is not raw
  std::size_t advice_told_ = 0;
  std::unique_ptr<Port> port_;
  std::list<Watcher> watchers_;
  std::list<Listener> listeners_;
  std::deque<TimedFrame> backlog_;  // not on the bus yet: time stands still, or the wire is full
  bool spaced_ = false;             // frames wait until the line is quiet, since time slipped,
  SimTime spaced_until_{0};         // at least until then
  bool flooded_ = false;            // too many frames for that: the backlog waits for room only
  bool advancing_ = false;          // watchers look, and may put frames on the bus
  std::uint64_t moves_ = 0;         // of the bus, when it was last looked at
  std::uint64_t backlog_lost_ = 0;
  std::array<std::uint64_t, protocol::kMaxId + 1> sent_{};  // by drive
  std::map<int, std::uint64_t> refused_;  // writes to ROM, one after the other; by drive
  std::vector<TimedFrame> replies_;       // these three are kept for their memory
  std::vector<RomWrite> rom_writes_;
  std::vector<protocol::Frame> leaving_;
};

}  // namespace lk::emulator
