#include "emulator/io/live/world.hpp"

#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <ctime>
#include <utility>

namespace lk::emulator {
namespace {

/// Longest sleep during traffic. The model advances at each wake-up, so a query waits less for it.
constexpr MonoTime kShortSleep = std::chrono::milliseconds(1);
/// Longest sleep without traffic: saves wake-ups, but the first query waits longer for the model.
constexpr MonoTime kLongSleep = std::chrono::milliseconds(5);
constexpr MonoTime kTrafficEnds = std::chrono::milliseconds(200);  // without a frame
/// Longest time that timers and clients are starved by back-to-back frames.
constexpr MonoTime kPollTime = std::chrono::milliseconds(3);
/// Longest time of a receive with Port::Wait::kForOne: two ticks of the kernel, 10 ms each.
constexpr MonoTime kLongestReceive = std::chrono::milliseconds(20);
/// Longest time for which lines advance before the loop serves clients and timers.
constexpr MonoTime kSlice = std::chrono::milliseconds(10);
/// Step by which an advance moves all lines, so that they are together when it is cancelled.
constexpr SimTime kStride = std::chrono::milliseconds(1);
constexpr auto kReplyPoll = std::chrono::milliseconds(1);

/// Waits until a socket is readable; ignores descriptors of −1. Returns false on a time-out. Sets
/// `sockets[n].revents`, not 0 for a readable socket.
bool wait_for_frames(std::span<pollfd> sockets, std::chrono::nanoseconds timeout) {
  timeout = std::max(timeout, std::chrono::nanoseconds(0));
  const auto seconds = std::chrono::floor<std::chrono::seconds>(timeout);
  const timespec interval{static_cast<time_t>(seconds.count()),
                          static_cast<long>((timeout - seconds).count())};
  return ::ppoll(sockets.data(), sockets.size(), &interval, nullptr) > 0;
}

SimTime latest(const std::vector<std::unique_ptr<Line>>& lines) {
  SimTime time{0};
  for (const auto& line : lines) time = std::max(time, line->bus().time());
  return time;
}

}  // namespace

World::World(boost::asio::io_context& loop, ClockMode mode)
    : loop_(loop),
      seen_(monotonic_now()),
      last_frame_(seen_ - kTrafficEnds),
      clock_(seen_, mode),
      timer_(loop, [this] { serve_all(Sockets::kOfBusyLines); }),
      reply_timer_(loop) {}

Line& World::add(const BusConfig& bus) {
  lines_.push_back(std::make_unique<Line>(bus));
  return *lines_.back();
}

SimTime World::time() const {
  SimTime time = SimTime::max();
  for (const auto& line : lines_) time = std::min(time, line->bus().time());
  return lines_.empty() ? SimTime{0} : time;
}

void World::start() {
  // By default the kernel ends sleeps up to 50 µs late, to save wake-ups.
  ::prctl(PR_SET_TIMERSLACK, 1);
  std::vector<BusConfig> robot;
  for (const auto& line : lines_) {
    robot.push_back(line->config());
    buses_.push_back(&line->bus_on_body());
  }
  if (Coupling::needed(robot)) coupling_.emplace(robot, buses_);
  clock_ = SimClock(monotonic_now(), clock_.mode());
  serve_all();
}

void World::stop() {
  stopped_ = true;
  end_advance();
}

/// Makes few system calls for a query, as on some machines one call takes as long as the rest of an
/// answer. The kernel's stamp of the frame gives the time, and mostly no timer is set.
void World::serve(std::size_t index) {
  if (stopped_) return;
  Line& line = *lines_[index];
  take_in(line);
  advance_to_now(line);
  poll_sockets();
  arm_timer();
}

void World::serve_all(Sockets sockets) {
  if (stopped_) return;
  seen_ = monotonic_now();
  for (const auto& line : lines_) {
    // Before advancing: frames that came while the machine was busy are earlier than now.
    if (sockets == Sockets::kAll || busy()) take_in(*line);
    advance_to_now(*line);
  }
  slip_reporter_.check(seen_);
  arm_timer();
}

/// Polls the sockets briefly after a frame: cheaper than returning to the event loop.
void World::poll_sockets() {
  const MonoTime leave = seen_ + kPollTime;
  while (!stopped_ && !clock_.mode().stepped && !on_body_step && seen_ < leave) {
    sockets_.clear();
    for (const auto& line : lines_) {
      if (!line->replies_have_left()) return;  // the loop reports when they can be sent
      sockets_.push_back({line->port() != nullptr ? line->port()->descriptor() : -1, POLLIN, 0});
    }
    const Line& first = *lines_.front();
    const bool only_frames_are_waited_for =
        lines_.size() == 1 && !coupling_ && first.port() != nullptr && first.port()->can_wait() &&
        !first.watched() && next_due() > seen_ + kLongestReceive;
    if (only_frames_are_waited_for) {  // a receive that waits makes `ppoll` needless
      if (take_in(*lines_.front(), Port::Wait::kForOne).any) {
        advance_to_now(*lines_.front());
        continue;
      }
      advance_to_now(*lines_.front());
      return;
    }
    const MonoTime due = next_due();
    const MonoTime wake = std::min(due, seen_ + kShortSleep);
    const bool frames = wait_for_frames(sockets_, wake - seen_);
    if (!frames) seen_ = monotonic_now();
    bool any = false;
    for (std::size_t n = 0; n < lines_.size(); ++n) {
      const bool readable = frames && sockets_[n].revents != 0;
      if (readable) any = take_in(*lines_[n]).any || any;
      if (readable || !frames || due <= seen_) advance_to_now(*lines_[n]);
    }
    if (!any && due > seen_) return;
  }
}

/// Takes the frames that have arrived on a line. Updates `seen_` even after only invalid bytes: a
/// host that sends nothing else must not stop time.
World::Taken World::take_in(Line& line, Port::Wait wait) {
  Taken taken;
  if (line.port() == nullptr) return taken;
  const auto take = [&](std::span<const ReceivedFrame> frames) {
    taken.any = true;
    seen_ = stamps_.reached(frames.back().stamp, seen_);
    // Without a modelled wire, a query is answered at the instant of its stamp. With one, some time
    // has passed since then, so the clock is read.
    if (line.config().bitrate > 0) seen_ = std::max(seen_, monotonic_now());
    last_frame_ = seen_;
    follow_clock(line);
    for (const ReceivedFrame& in : frames) {
      const TimedFrame frame{.at = clock_.time_at(stamps_.arrival(in.stamp, seen_)),
                             .frame = in.frame,
                             .sender = in.sender};
      // Coupled lines advance together, so `accept` must not advance one alone.
      const bool later = clock_.mode().stepped || coupling_;
      later ? line.enqueue(frame) : line.accept(frame);
    }
  };
  line.port()->set_room(line.room());
  taken.more = line.port()->receive(take, wait);
  if (!taken.any) seen_ = monotonic_now();
  return taken;
}

/// Returns the time to which the line should advance. The clock slips if the line is too far
/// behind.
SimTime World::follow_clock(Line& line) {
  const auto [now, slipped] = clock_.read(seen_, line.bus().time());
  if (slipped > SimTime{0}) {
    slip_reporter_.slipped(seen_, slipped);
    for (const auto& one : lines_) one->note_slip();
  }
  return now;
}

void World::advance_to_now(Line& line) {
  if (!clock_.mode().stepped) {
    const SimTime now = std::max(follow_clock(line), line.bus().time());
    // A fast clock may need more than kSlice: the rest follows in a later call, or time slips.
    if (coupling_) {
      advance_all_to(now, seen_ + kSlice, Line::WaitPolicy::kNone);
    } else {
      line.advance_to(now, seen_ + kSlice, Line::WaitPolicy::kNone);
    }
  }
  if (line.port() != nullptr) line.port()->end_turn();
}

Line::Progress World::advance_all_to(SimTime until, MonoTime deadline, Line::WaitPolicy policy) {
  while (coupling_ && coupling_->next_due() <= until) {
    const SimTime due = coupling_->next_due();
    for (const auto& line : lines_) {
      const auto progress = line->reach(due, deadline, policy);
      if (progress != Line::Progress::kReached) return progress;
    }
    const bool was_well = !coupling_->failure();
    if (coupling_->under_way()) {
      coupling_->finish(buses_);
      body_is_ready_ = !on_body_step || on_body_step();
    }
    if (!std::exchange(body_is_ready_, false)) {
      return due == until ? Line::Progress::kReached : Line::Progress::kBlocked;
    }
    coupling_->begin(buses_);
    if (was_well && coupling_->failure()) {
      spdlog::error("body simulation stopped: {}", *coupling_->failure());
    }
  }
  for (const auto& line : lines_) {
    const auto progress = line->advance_to(std::max(until, line->bus().time()), deadline, policy);
    if (progress != Line::Progress::kReached) return progress;
  }
  return Line::Progress::kReached;
}

void World::couple(std::unique_ptr<Mechanism> body, std::span<const CoupledDrive> drives) {
  const SimTime now = latest(lines_);
  const SimTime step = body->step();
  coupling_.emplace(std::move(body), drives, (now + step - SimTime{1}) / step * step);
  body_is_ready_ = true;
}

void World::uncouple() {
  coupling_.reset();
  if (advance_) post_continue_advance();
}

void World::body_is_ready() {
  body_is_ready_ = true;
  if (advance_) {
    post_continue_advance();
  } else if (!clock_.mode().stepped) {
    serve_all();
  }
}

MonoTime World::next_due() const {
  MonoTime first = MonoTime::max();
  if (waits_for_body()) return first;
  // The simulator that owns the body needs each step on time.
  if (coupling_ && on_body_step) first = clock_.to_mono(coupling_->next_due());
  for (const auto& line : lines_) {
    if (const auto due = line->bus().next_due()) first = std::min(first, clock_.to_mono(*due));
  }
  return first;
}

/// Returns true if there are observers or recent frames.
bool World::busy() const {
  return seen_ - last_frame_ < kTrafficEnds ||
         std::ranges::any_of(lines_, [](const auto& line) { return line->watched(); });
}

void World::arm_timer() {
  if (clock_.mode().stepped) return;
  const MonoTime sleep = busy() ? kShortSleep : kLongSleep;
  timer_.wake_by(std::min(seen_ + sleep, next_due()), seen_);
}

void World::set_clock(ClockMode mode) {
  if (stopped_) return;
  serve_all();
  end_advance();
  const SimTime now = latest(lines_);
  clock_.switch_to(mode, monotonic_now(), now);
  serve_all();
}

// --- stepped

void World::advance(SimTime to, OnAdvanced done) {
  advance_ = Advance{to, std::move(done), ++advances_, std::nullopt, 0};
  // Frames that hosts sent before the advance are in the sockets by now: CAN delivers them at once
  // on one machine. A TCP host that waits for an acknowledgement gets it from `end_turn`, and its
  // next bytes follow.
  constexpr int kMaxRounds = 100;  // a host may send without end
  for (const auto& line : lines_) {
    for (int n = 0; n < kMaxRounds; ++n) {
      const Taken taken = take_in(*line);
      if (line->port() != nullptr) line->port()->end_turn();
      if (!taken.any && !taken.more) break;
    }
  }
  post_continue_advance();
}

void World::post_continue_advance() {
  boost::asio::post(loop_, [this, mine = advance_->number] {
    if (advance_ && advance_->number == mine) continue_advance();
  });
}

void World::continue_advance() {
  const MonoTime deadline = monotonic_now() + kSlice;
  auto progress = Line::Progress::kReached;
  SimTime next = clock_.stepped_time();
  do {
    next = std::min(advance_->to, time() + kStride);
    progress = advance_all_to(next, deadline, Line::WaitPolicy::kForReplies);
    if (progress == Line::Progress::kReached) clock_.step_to(next);
  } while (progress == Line::Progress::kReached && next < advance_->to &&
           monotonic_now() < deadline);
  const bool reached = progress == Line::Progress::kReached;
  if (progress == Line::Progress::kBlocked && waits_for_body()) return;  // until body_is_ready
  if (progress == Line::Progress::kOutOfTime || (reached && next < advance_->to)) {
    return post_continue_advance();
  }
  const bool left =
      std::ranges::all_of(lines_, [](const auto& line) { return line->replies_have_left(); });
  if (reached && left) return end_advance(Advanced::kReached);
  std::uint64_t sent = 0;
  for (const auto& line : lines_) sent += line->port() != nullptr ? line->port()->stats().sent : 0;
  const MonoTime now = monotonic_now();
  if (!advance_->deadline || sent != advance_->sent) advance_->deadline = now + kReplyTimeout;
  advance_->sent = sent;
  if (now >= *advance_->deadline) return end_advance(Advanced::kStuck);
  reply_timer_.expires_after(kReplyPoll);
  reply_timer_.async_wait([this, mine = advance_->number](const auto& /*error*/) {
    if (advance_ && advance_->number == mine) continue_advance();
  });
}

void World::end_advance(Advanced how) {
  if (!advance_) return;
  const OnAdvanced done = std::move(advance_->done);
  advance_.reset();
  const SimTime now = latest(lines_);
  clock_.step_to(now);
  done(how);
}

Line* find_line(const World& world, const std::string& bus) {
  const auto found =
      std::ranges::find_if(world.lines(), [&](const auto& line) { return line->name() == bus; });
  return found == world.lines().end() ? nullptr : found->get();
}

}  // namespace lk::emulator
