#include "emulator/advice/bus_watch.hpp"

#include <utility>

namespace lk::emulator {
namespace {

// clang-format off
constexpr Words kCrowded{"{1} frames wait for the wire, and {2} did not even find room in the send queue",
                         "有 {1} 帧在等待上线，另有 {2} 帧连发送队列都没排进"};
constexpr Words kTooMuch{"the drive does not take the query: 16 replies wait in it already",
                         "驱动器不接受这条命令帧：已有 16 个回复在其中等待"};
// clang-format on

}  // namespace

std::optional<Finding> WireWatch::hear() const {
  if (!too_fast_) return std::nullopt;
  return Finding{AdviceKind::kFasterThanWire,
                 &kCrowded,
                 {static_cast<double>(waiting_), static_cast<double>(lost_)}};
}

void Disturbances::look(const Bus& bus, const BusStats& stats) {
  // A babbling drive or a disturbed wire is not the host's fault.
  const std::uint64_t foreign = stats.extra_frames + stats.error_frames;
  if (foreign > std::exchange(foreign_, foreign) || bus.replies_are_held()) extend(bus.time());
  stalled_until_ = bus.hosts_stalled_until();
  if (stalled_until_ > SimTime{0}) extend(stalled_until_);
}

void WireWatch::look(const Bus& bus, const BusStats& stats, bool disturbed) {
  const SimTime now = bus.time();
  waiting_ = stats.frames_waiting > kWaiting ? bus.host_frames_ready() : stats.frames_waiting;
  const std::uint64_t lost = stats.count(Drop::kQueueFull);
  const bool runs_over = lost > std::exchange(lost_, lost) && waiting_ > kWaiting;
  if (waiting_ <= kWaiting || disturbed) {
    crowded_since_.reset();
  } else if (!crowded_since_) {
    crowded_since_ = now;
  }
  too_fast_ = (runs_over && !disturbed) || (crowded_since_ && now - *crowded_since_ >= kLong);
}

std::optional<BusyWatch::Busy> BusyWatch::look(const BusStats& stats) {
  const std::uint64_t busy = stats.count(Drop::kDriveBusy);
  const std::uint64_t times = busy - std::exchange(seen_, busy);
  if (times == 0) return std::nullopt;
  return Busy{{AdviceKind::kFasterThanDrive, &kTooMuch}, times};
}

}  // namespace lk::emulator
