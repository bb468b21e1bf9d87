#include "emulator/program/world.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <utility>

namespace lk::emulator {
namespace {

/// The model is advanced at least this often, so that a query never finds much to catch up with.
constexpr MonoTime kLongestSleep = std::chrono::milliseconds(1);
/// The loop has other things to do as well.
constexpr MonoTime kSlice = std::chrono::milliseconds(10);
/// All lines move together, this far at a time, so that an advance can end anywhere.
constexpr SimTime kStride = std::chrono::milliseconds(1);
constexpr auto kReplyPoll = std::chrono::milliseconds(1);

}  // namespace

World::World(boost::asio::io_context& loop, ClockMode mode)
    : loop_(loop),
      clock_(monotonic_now(), mode),
      timer_(loop, [this] { serve_all(); }),
      patience_(loop) {}

Line& World::add(const BusConfig& bus) {
  lines_.push_back(std::make_unique<Line>(bus));
  return *lines_.back();
}

Line* World::find_line(const std::string& bus) {
  for (const auto& line : lines_) {
    if (line->name() == bus) return line.get();
  }
  return nullptr;
}

SimTime World::time() const {
  SimTime time = SimTime::max();
  for (const auto& line : lines_) time = std::min(time, line->bus().time());
  return lines_.empty() ? SimTime{0} : time;
}

void World::start() {
  clock_ = SimClock(monotonic_now(), clock_.mode());
  serve_all();
}

void World::stop() {
  stopped_ = true;
  end_advance(Advanced::kCancelled);
}

void World::serve(std::size_t index) {
  if (stopped_) return;
  const MonoTime mono = monotonic_now();
  serve(*lines_[index], mono);
  arm_timer(mono);
}

void World::serve_all() {
  if (stopped_) return;
  // One reading for all: a clock costs nothing on most machines, and a system call on some.
  const MonoTime mono = monotonic_now();
  for (const auto& line : lines_) serve(*line, mono);
  slip_reporter_.check(mono);
  arm_timer(mono);
}

void World::serve(Line& line, MonoTime mono) {
  const auto [now, slipped] = clock_.read(mono, line.bus().time());
  if (slipped > SimTime{0}) slip_reporter_.slipped(mono, slipped);
  line.take_in(clock_, now);
  if (clock_.mode().stepped) return;
  // Time that goes by fast may be more than fits in between: the rest has to wait, or slips.
  line.bring_to(now, mono + kSlice, Line::Patience::kNone);
}

void World::arm_timer(MonoTime mono) {
  if (clock_.mode().stepped) return;
  MonoTime wake = mono + kLongestSleep;
  for (const auto& line : lines_) {
    if (const auto due = line->bus().next_due()) wake = std::min(wake, clock_.to_mono(*due));
  }
  timer_.wake_by(wake);
}

void World::set_clock(ClockMode mode) {
  if (stopped_) return;
  serve_all();
  end_advance(Advanced::kCancelled);
  SimTime now{0};
  for (const auto& line : lines_) now = std::max(now, line->bus().time());
  clock_.switch_to(mode, monotonic_now(), now);
  serve_all();
}

// --- stepped
// -----------------------------------------------------------------------------------

void World::advance(SimTime to, OnAdvanced done) {
  advance_ = Advance{to, std::move(done), ++advances_, std::nullopt, 0};
  take_in_all();
  go_on_soon();
}

/// What hosts sent before time was told to move is in the sockets by now: sending on a CAN socket
/// hands the frame to all others of this machine. Bounded, as a host may go on sending.
void World::take_in_all() {
  constexpr int kMostRounds = 100;
  for (const auto& line : lines_) {
    for (int n = 0; n < kMostRounds && line->take_in(clock_, clock_.stands_at()); ++n)
      ;
  }
}

void World::go_on_soon() {
  boost::asio::post(loop_, [this, mine = advance_->number] {
    if (advance_ && advance_->number == mine) go_on();
  });
}

void World::go_on() {
  const Line::Progress progress = move(monotonic_now() + kSlice);
  if (progress == Line::Progress::kOutOfTime) {
    go_on_soon();
    return;
  }
  const bool left =
      std::ranges::all_of(lines_, [](const auto& line) { return line->replies_have_left(); });
  if (progress == Line::Progress::kThere && left) {
    end_advance(Advanced::kThere);
  } else {
    wait_for_replies();
  }
}

Line::Progress World::move(MonoTime deadline) {
  for (;;) {
    const SimTime next = std::min(advance_->to, time() + kStride);
    for (const auto& line : lines_) {
      const auto progress = line->bring_to(next, deadline, Line::Patience::kForReplies);
      if (progress != Line::Progress::kThere) return progress;
    }
    clock_.step_to(next);
    if (next >= advance_->to) return Line::Progress::kThere;
    if (monotonic_now() >= deadline) return Line::Progress::kOutOfTime;
  }
}

std::uint64_t World::replies_sent() const {
  std::uint64_t sent = 0;
  for (const auto& line : lines_) sent += line->port() != nullptr ? line->port()->stats().sent : 0;
  return sent;
}

void World::wait_for_replies() {
  const MonoTime now = monotonic_now();
  const std::uint64_t sent = replies_sent();
  if (!advance_->give_up || sent != advance_->sent) advance_->give_up = now + kMostPatience;
  advance_->sent = sent;
  if (now >= *advance_->give_up) {
    end_advance(Advanced::kStuck);
    return;
  }
  patience_.expires_after(kReplyPoll);
  patience_.async_wait([this, mine = advance_->number](const auto& /*error*/) {
    if (advance_ && advance_->number == mine) go_on();
  });
}

void World::end_advance(Advanced how) {
  if (!advance_) return;
  const OnAdvanced done = std::move(advance_->done);
  advance_.reset();
  SimTime now{0};
  for (const auto& line : lines_) now = std::max(now, line->bus().time());
  clock_.step_to(now);
  done(how);
}

}  // namespace lk::emulator
