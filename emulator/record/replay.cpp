#include "emulator/record/replay.hpp"

#include <algorithm>

namespace lk::emulator {
namespace {

using std::chrono::microseconds;

bool same(const TimedFrame& a, const TimedFrame& b) {
  return a.frame == b.frame &&
         std::chrono::floor<microseconds>(a.at) == std::chrono::floor<microseconds>(b.at);
}

std::optional<TimedFrame> front(const std::deque<TimedFrame>& frames) {
  return frames.empty() ? std::nullopt : std::optional(frames.front());
}

}  // namespace

Replay::Replay(const std::vector<BusConfig>& buses) {
  for (const BusConfig& bus : buses)
    lines_.push_back({bus.interface, Bus(bus), {}, {}, {}, SimTime{0}});
}

std::optional<std::size_t> Replay::find(std::string_view interface) const {
  const auto found = std::ranges::find(lines_, interface, &Line::interface);
  return found != lines_.end() ? std::optional(static_cast<std::size_t>(found - lines_.begin()))
                               : std::nullopt;
}

void Replay::host_frame(std::size_t n, SimTime at, const protocol::Frame& frame) {
  end(n, at);
  if (difference_) return;
  ++host_frames_;
  const TimedFrame timed{at, frame};
  if (on_frame) on_frame(n, {timed, true});
  note(lines_[n], {timed, true});
  lines_[n].bus.receive(timed);
}

void Replay::recorded_reply(std::size_t n, const TimedFrame& reply) {
  lines_[n].recorded.push_back(reply);
  lines_[n].last = std::max(lines_[n].last, reply.at + microseconds(1) - SimTime(1));
}

bool Replay::bring(std::size_t n, SimTime at) {
  if (difference_) return false;
  run(n, at);
  Line& line = lines_[n];
  const bool missing =
      !line.recorded.empty() && line.recorded.front().at < std::chrono::floor<microseconds>(at);
  if (missing || !line.replayed.empty()) differ(line);
  return !difference_;
}

void Replay::end(std::size_t n, SimTime at) {
  if (difference_) return;
  Line& line = lines_[n];
  line.last = std::max(line.last, at);
  run(n, at);
  if (!line.recorded.empty() || !line.replayed.empty()) differ(line);
}

void Replay::break_off() {
  for (std::size_t n = 0; n < lines_.size() && !difference_; ++n) {
    run(n, lines_[n].last);
    if (!lines_[n].recorded.empty()) differ(lines_[n]);
  }
}

void Replay::run(std::size_t n, SimTime until) {
  Line& line = lines_[n];
  advance(n, until);
  taken_.clear();
  line.bus.take_replies(taken_);
  // Discards the writes: a write that failed in the original run is restored later.
  std::vector<RomWrite> kept;
  line.bus.take_rom_writes(kept);
  for (const TimedFrame& reply : taken_) {
    if (on_frame) on_frame(n, {reply, false});
    line.replayed.push_back(reply);
  }
  compare(line);
}

void Replay::compare(Line& line) {
  while (!difference_ && !line.recorded.empty() && !line.replayed.empty()) {
    if (!same(line.recorded.front(), line.replayed.front())) {
      differ(line);
      return;
    }
    note(line, {line.replayed.front(), false});
    line.recorded.pop_front();
    line.replayed.pop_front();
    ++equal_replies_;
  }
}

void Replay::differ(Line& line) {
  if (difference_) return;
  difference_ = Difference{line.interface,
                           front(line.recorded),
                           front(line.replayed),
                           {line.before.begin(), line.before.end()}};
}

void Replay::note(Line& line, const ReplayedFrame& frame) {
  if (line.before.size() == kContext) line.before.pop_front();
  line.before.push_back(frame);
}

}  // namespace lk::emulator
