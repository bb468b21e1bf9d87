#pragma once

/// @file Transmit queues of hosts, by adapter and driver.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace lk::emulator {

/// Fate of a host's frame if the queue is full.
enum class QueueFull : std::uint8_t {
  kRefuse,      // the host's write fails: ENOBUFS, an exception, `\a` on slcan
  kDropNewest,  // the frame is lost without a report
  kDropOldest,  // the oldest queued frame is lost without a report
};
inline constexpr std::array<std::string_view, 3> kQueueFullWords{"refuse", "drop_newest",
                                                                 "drop_oldest"};

/// Queue between the writes of the hosts and the wire. The frame on the wire is one of `frames`.
struct HostQueue {
  static constexpr std::size_t kDefaultFrames = 1024;
  static constexpr std::size_t kMaxFrames = 4096;

  std::string_view name;  // "gs_usb"; "custom" if the file states a number
  std::size_t frames = 0;
  QueueFull full = QueueFull::kDropNewest;
};

/// All presets; the first is the default of a bus.
std::span<const HostQueue> host_queues();

}  // namespace lk::emulator
