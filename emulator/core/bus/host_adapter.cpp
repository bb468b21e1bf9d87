#include "emulator/core/bus/host_adapter.hpp"

#include <algorithm>
#include <chrono>

#include "emulator/core/seed.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {
namespace {

SimTime from_us(double time_us) { return SimTime(protocol::rounded(time_us * 1e3)); }

/// Rounds `at` up to a multiple of `period`.
SimTime tick_from(SimTime at, SimTime period) {
  return (at + period - SimTime{1}) / period * period;
}

}  // namespace

double HostAdapter::draw() { return uniform(random_ = mix(random_)); }

SimTime HostAdapter::delay_frame(Direction& way, SimTime at, double mean_us) {
  way.line_free = std::max(at, way.line_free) + from_us(times_.frame_us);
  double latency_us = mean_us;
  if (times_.jitter_us > 0) latency_us += times_.jitter_us * (2 * draw() - 1);
  if (times_.tail_probability > 0 && draw() < times_.tail_probability) {
    latency_us += times_.tail_us;
  }
  way.last = std::max(way.line_free + from_us(std::max(latency_us, 0.0)), way.last);
  return way.last;
}

HostAdapter::ToWire HostAdapter::to_wire(SimTime at) {
  AdapterEffects shown;
  SimTime written = at;
  // A write during a stall waits for the end of the stall and does not begin another one.
  if (times_.stall_every > 0 && at >= tx_.line_free) {
    ++unanswered_;
    shown.stalled = at - last_from_wire_ >= kAdapterSilence &&
                    unanswered_ % static_cast<std::uint64_t>(times_.stall_every) == 0;
    if (shown.stalled) stalled_until_ = written += from_us(times_.stall_us);
  }
  const SimTime ready = delay_frame(tx_, written, times_.tx_us);
  shown.late = ready > written;
  return {ready, shown};
}

AdapterEffects HostAdapter::from_wire(const TimedFrame& frame, std::size_t size) {
  AdapterEffects shown;
  if (frame.frame.kind != protocol::FrameKind::kError) {
    last_from_wire_ = frame.at;
    unanswered_ = 0;
  }
  const bool full =
      times_.depth > 0 ? waiting_size_ + size > times_.depth : waiting_.size() >= kMaxInAdapter;
  if (size > 0 && full) {
    shown.lost = true;
    shown.reported = times_.reports_overrun && !overrun_;
    overrun_ = true;
    return shown;
  }
  overrun_ = overrun_ && size == 0;
  const SimTime there = delay_frame(rx_, frame.at, times_.rx_us);
  shown.late = there > frame.at;
  SimTime due = there;
  if (times_.batch_us > 0) {
    const bool goes = times_.batch_most > 0 && waiting_size_ + size >= times_.batch_most;
    if (goes) {  // the batch is full: all pending frames go now
      for (Waiting& one : waiting_) one.frame.at = std::min(one.frame.at, there);
    } else {
      due = tick_from(there, from_us(times_.batch_us));
    }
    shown.batched = due > there;
  }
  if (!waiting_.empty()) due = std::max(due, waiting_.back().frame.at);
  waiting_.push_back({frame, size});
  waiting_.back().frame.at = due;
  waiting_size_ += size;
  return shown;
}

std::size_t HostAdapter::waiting() const {
  return static_cast<std::size_t>(std::ranges::count_if(waiting_, [](const Waiting& one) {
    return one.frame.frame.kind != protocol::FrameKind::kError && one.frame.sender == 0;
  }));
}

TimedFrame HostAdapter::take() {
  const TimedFrame frame = waiting_.front().frame;
  waiting_size_ -= waiting_.front().size;
  waiting_.erase(waiting_.begin());
  return frame;
}

}  // namespace lk::emulator
