#include "emulator/io/live/line.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "emulator/core/scenario/sampler.hpp"

namespace lk::emulator {
namespace {

/// Longest step of a bus between two checks of the deadline. Not shorter than the loop's longest
/// sleep, after which one step then suffices: each further step reads the clock.
constexpr SimTime kStep = std::chrono::milliseconds(5);
/// With WaitPolicy::kForReplies, time waits above this number of unsent replies: a quarter of the
/// port's queue.
constexpr std::size_t kMaxLeaving = 256;

/// All frames sent before a slip have been read this long after it.
constexpr SimTime kAfterSlip = std::chrono::milliseconds(2);
/// Longest wait for a quiet line after a slip.
constexpr SimTime kLongestWait = std::chrono::seconds(1);

SimTime whole_us(SimTime time) { return std::chrono::ceil<std::chrono::microseconds>(time); }

/// Returns the IDs as ranges: "1-4,7".
std::string print_ids(const std::vector<ServoConfig>& servos) {
  std::string text;
  for (std::size_t i = 0; i < servos.size();) {
    std::size_t last = i;
    while (last + 1 < servos.size() && servos[last + 1].id == servos[last].id + 1) ++last;
    if (i > 0) text += ',';
    text += std::to_string(servos[i].id);
    if (last > i) text += '-';
    if (last > i) text += std::to_string(servos[last].id);
    i = last + 1;
  }
  return text;
}

/// All watchers of a line as one.
struct AllWatchers {
  std::list<Watcher>& watchers;

  SimTime next_due() const {
    SimTime due = SimTime::max();
    for (const Watcher& watcher : watchers) due = std::min(due, watcher.next_due());
    return due;
  }
  void sample(const Bus& bus) const {
    for (const Watcher& watcher : watchers) {
      if (watcher.next_due() <= bus.time()) watcher.sample(bus);
    }
  }
};

}  // namespace

SimTime frame_instant(SimTime at, SimTime reached) { return whole_us(std::max(at, reached)); }

Line::Line(const BusConfig& config)
    : config_(config),
      ids_(print_ids(config.servos)),
      bus_(config),
      gate_(config),
      adviser_(config) {}

void Line::connect(boost::asio::io_context& loop, Interfaces allowed,
                   std::function<void()> on_frames) {
  port_ = make_port(loop, config_, allowed, std::move(on_frames));
}

void Line::accept(const TimedFrame& in) {
  waits_for_quiet_line_ =
      waits_for_quiet_line_ &&
      (bus_.time() < waits_at_least_until_ || !backlog_.empty() || !bus_.state().line_is_quiet());
  if (waits_for_quiet_line_ && backlog_.size() >= kMaxSpaced) {
    waits_for_quiet_line_ = false;
    flooded_ = true;
  }
  if (flooded_) {  // earlier frames go first, as far as the bus has room
    if (advancing_) {
      take_from_backlog();
    } else {
      advance_to(frame_instant(in.at, bus_.time()), MonoTime::max(), WaitPolicy::kNone);
    }
  }
  // If both queues are full, the bus gets the frame, to drop and count it.
  const bool is_lost =
      flooded_ && backlog_.size() >= kMaxSpaced && bus_.state().wire.host_queue_full();
  if (waits_for_quiet_line_ || (!backlog_.empty() && !is_lost)) {
    enqueue(in);
    return;
  }
  // Advances here: Bus::receive would advance without calling watchers.
  if (in.at > bus_.time() &&
      (bus_.state().wire.host_queue_full() || bus_.state().adapted() || !listeners.empty())) {
    advance_watched(in.at);
  }
  put_on_bus(in);
}

void Line::accept_in_turn(const TimedFrame& in) {
  if (config_.serial && (!backlog_.empty() || !bus_.state().line_is_quiet())) {
    waits_for_quiet_line_ = true;
    waits_at_least_until_ = std::max(waits_at_least_until_, bus_.time());
  }
  accept(in);
}

std::size_t Line::room() const {
  if (config_.serial || config_.host_queue.full != QueueFull::kRefuse) return SIZE_MAX;
  const std::size_t queued = bus_.state().wire.host_queue_size() + backlog_.size();
  return config_.host_queue.frames - std::min(queued, config_.host_queue.frames);
}

void Line::put_on_bus(const TimedFrame& in) {
  TimedFrame effective = in;
  effective.at = frame_instant(in.at, bus_.time());
  if (!listeners.empty()) {  // listeners must get earlier replies before this frame
    bus_.advance_to(effective.at);
    send_replies();
  }
  adviser_.on_query(effective);
  if (port_ && !terminal_advised_ && effective.frame.kind == protocol::FrameKind::kSerial) {
    const TerminalFlags& flags = port_->host_flags();
    terminal_advised_ = !flags.empty();
    adviser_.on_terminal_flags(flags, effective);
  }
  for (const Listener& listener : listeners) {
    if (listener.query) listener.query(effective);
  }
  bus_.receive(effective);
}

void Line::enqueue(const TimedFrame& in) {
  if (backlog_.size() < kMaxBacklog) {
    backlog_.push_back(in);
    return;
  }
  if (backlog_lost_++ == 0) {
    spdlog::warn("{}: {} frames are queued while time is stopped; further frames are lost", name(),
                 kMaxBacklog);
  }
}

void Line::note_slip() {
  waits_for_quiet_line_ = config_.serial.has_value();
  waits_at_least_until_ = bus_.time() + kAfterSlip;
  adviser_.note_slip(bus_.time());
}

bool Line::backlog_waits() const {
  if (bus_.state().wire.host_queue_full()) return true;
  return waits_for_quiet_line_ && bus_.time() < waits_at_least_until_ + kLongestWait &&
         !bus_.state().line_is_quiet();
}

void Line::take_from_backlog() {
  while (!backlog_.empty() && !backlog_waits() && backlog_.front().at <= bus_.time()) {
    put_on_bus(backlog_.front());
    backlog_.pop_front();
  }
  flooded_ = flooded_ && !backlog_.empty();
}

void Line::advance_watched(SimTime until) {
  AllWatchers all{watchers};
  const bool from_watcher = std::exchange(advancing_, true);
  deliver_watched(bus_, until, all);
  advancing_ = from_watcher;
  send_replies();  // before `settle`, which computes motors that these replies do not need
  bus_.settle();
  if (std::exchange(address_changes_, bus_.state().nodes.address_changes()) !=
          bus_.state().nodes.address_changes() &&
      on_address_change)
    on_address_change();
  if (bus_.state().host.unacknowledged && !std::exchange(reported_no_ack_, true)) {
    spdlog::warn("{}: no drive acknowledges: the hosts' frames wait in their queue", name());
  }
  const HostCut cut = bus_.state().host.cut;
  if (port_) port_->set_gone(cut >= HostCut::kGone, cut == HostCut::kMoved);
  adviser_.observe(bus_);
  for (; advice_reported_ < adviser_.advice().size(); ++advice_reported_) {
    if (on_advice) on_advice(adviser_.advice()[advice_reported_]);
  }
}

Line::Progress Line::advance_to(SimTime until, MonoTime deadline, WaitPolicy policy) {
  for (;;) {
    take_from_backlog();
    SimTime target = std::min(until, bus_.time() + kStep);
    if (!backlog_.empty()) {
      // Stops where the next queued frame can go on the bus.
      const SimTime frame =
          backlog_waits() ? whole_us(bus_.next_due().value_or(target)) : backlog_.front().at;
      target = std::max(std::min(target, frame), bus_.time());
    }
    advance_watched(target);
    const bool more_is_due =
        !backlog_.empty() && !backlog_waits() && backlog_.front().at <= bus_.time();
    if (bus_.time() >= until && !more_is_due) return Progress::kReached;
    const bool has_long_queue = port_ && port_->pending() > kMaxLeaving;
    if (policy == WaitPolicy::kForReplies && has_long_queue) return Progress::kBlocked;
    if (monotonic_now() >= deadline) return Progress::kOutOfTime;
  }
}

Line::Progress Line::reach(SimTime due, MonoTime deadline, WaitPolicy policy) {
  if (bus_.time() >= due) return Progress::kReached;
  const Progress progress = advance_to(std::max(due - SimTime{1}, bus_.time()), deadline, policy);
  if (progress == Progress::kReached) bus_.reach(due);
  return progress;
}

void Line::announce(const std::string& json) const {
  for (const Listener& listener : listeners) {
    if (listener.directive) listener.directive(bus_.time(), json);
  }
}

bool Line::perform(const TimedDirective& directive) {
  return directive.when || directive.at > bus_.time() ? bus_.plan(directive)
                                                      : bus_.apply(directive.directive);
}

void Line::send_replies() {
  rom_writes_.clear();
  bus_.take_rom_writes(rom_writes_);
  for (const RomWrite& write : rom_writes_) {
    gate_.begin(write);
    if (on_rom_write) {
      on_rom_write(write);
    } else {
      settle_rom(write, 0);
    }
  }
  replies_.clear();
  bus_.take_replies(replies_);
  const bool up = is_up();
  for (const TimedFrame& reply : replies_) {
    if (reply.sender != 0) {
      send_leaving();
      if (port_) port_->pass_on(reply.frame, reply.sender);
      continue;
    }
    const int id = drive_of(reply);
    if (!reply.echo) {
      if (up) ++sent_[static_cast<std::size_t>(id)];
      adviser_.on_reply(reply);
    }
    for (const Listener& listener : listeners) {
      if (listener.reply) listener.reply(reply);
    }
    gate_.pass(reply, leaving_);
  }
  send_leaving();
  if (port_ && !replies_.empty()) port_->end_turn();
}

void Line::send_leaving() {
  if (port_ && !leaving_.empty()) port_->send(leaving_);
  leaving_.clear();
}

void Line::settle_rom(const RomWrite& write, int error) {
  // Logs only the first failure and the recovery: hosts may write hundreds of times a second.
  std::uint64_t& refused = refused_[write.id];
  if (error != 0 && refused++ == 0) {
    spdlog::error("{}:{}: ROM not written: {}; the drive continues with RAM", name(), write.id,
                  std::generic_category().message(error));
  } else if (error == 0 && refused > 0) {
    spdlog::info("{}:{}: ROM is written again; {} writes were refused", name(), write.id,
                 std::exchange(refused, 0));
  }
  if (const auto* kept = gate_.settle(write, error == 0, leaving_)) {
    bus_.restore_rom(write.id, kept->rom, kept->wear);
    for (const Listener& listener : listeners) {
      if (listener.restored_rom) listener.restored_rom(bus_.time(), write.id, *kept);
    }
  }
  send_leaving();
  if (port_) port_->end_turn();
}

bool Line::replies_have_left() const { return gate_.idle() && (!port_ || port_->pending() == 0); }

}  // namespace lk::emulator
