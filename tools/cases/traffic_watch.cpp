#include "tools/cases/traffic_watch.hpp"

#include <algorithm>

#include "emulator/core/seed.hpp"
#include "protocol/commands.hpp"

namespace lk::emulator {
namespace {

bool can_be_command(const protocol::Frame& frame) {
  using protocol::FrameKind;
  return frame.dlc > 0 && !frame.extended &&
         (frame.kind == FrameKind::kData || frame.kind == FrameKind::kSerial);
}

/// Returns identifier, kind, format and length of a frame as one number, for the hash.
std::uint64_t head_of(const protocol::Frame& frame) {
  return (static_cast<std::uint64_t>(frame.id) << 32U) +
         (static_cast<std::uint64_t>(frame.kind) << 16U) + (frame.extended ? 1U << 8U : 0U) +
         frame.dlc;
}

}  // namespace

void TrafficWatch::observe(const std::vector<Traffic>& traffic) {
  for (const Traffic& one : traffic) {
    const protocol::Frame& frame = one.frame.frame;
    if (one.from_host) {
      if (!can_be_command(frame)) continue;
      const auto known = std::ranges::find_if(commands_, [&](const Command& command) {
        return command.bus == one.bus && command.id == frame.id;
      });
      if (known != commands_.end()) {
        known->byte = frame.data[0];
      } else {
        commands_.push_back({one.bus, frame.id, frame.data[0]});
      }
      continue;
    }
    std::uint64_t bytes = 0;
    for (std::size_t n = 0; n < frame.dlc && n < frame.data.size(); ++n) {
      bytes = mix(bytes + frame.data[n]);
    }
    const auto at = static_cast<std::uint64_t>(one.frame.at.count());
    reply_hash_ = mix(reply_hash_ ^ mix(at + bytes) ^ mix(head_of(frame) + mix(one.bus)));
  }
}

std::optional<std::uint8_t> TrafficWatch::command(std::size_t bus, int id) const {
  for (const Command& command : commands_) {
    if (command.bus == bus && command.id == protocol::kSingleDriveId + static_cast<unsigned>(id)) {
      return command.byte;
    }
  }
  return std::nullopt;
}

}  // namespace lk::emulator
