#include "emulator/record/replay_text.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "emulator/core/frame_text.hpp"
#include "emulator/frames/reply_values.hpp"

namespace lk::emulator {
namespace {

std::string instant(SimTime at) {
  const auto us = std::chrono::floor<std::chrono::microseconds>(at).count();
  return fmt::format("{}.{:06} s", us / 1'000'000, us % 1'000'000);
}

/// Returns the decoded values of a drive's frame.
std::string meaning(const protocol::Frame& frame, const BusConfig& bus) {
  for (const ServoConfig& servo : bus.servos) {
    const std::string said = values_text(ReplyReader(servo).values(frame));
    if (!said.empty()) return fmt::format("  drive {}: {}", servo.id, said);
  }
  return "";
}

std::string line(const char* what, const std::optional<TimedFrame>& reply, const BusConfig& bus) {
  if (!reply) return fmt::format("  {}  nothing\n", what);
  return fmt::format("  {}  {}  {}{}\n", what, instant(reply->at), frame_text(reply->frame),
                     meaning(reply->frame, bus));
}

}  // namespace

std::string difference_text(const Difference& difference, const BusConfig& bus,
                            const RecordingInfo& recording) {
  std::string text;
  if (recording.version != LKEMU_VERSION) {
    text = fmt::format("made by {}, the model differs: this is {}\n", recording.version,
                       LKEMU_VERSION);
  }
  const auto& first = difference.recorded ? difference.recorded : difference.replayed;
  text += fmt::format(
      "first difference on {} at {}:\n", difference.bus,
      instant(std::min(first->at, difference.replayed ? difference.replayed->at : first->at)));
  text += line("recorded", difference.recorded, bus);
  text += line("replayed", difference.replayed, bus);
  if (!difference.before.empty()) text += "before it:\n";
  for (const ReplayedFrame& frame : difference.before) {
    text += fmt::format("  {}  {}  {} {}\n", frame.from_host ? "host    " : "drive   ",
                        instant(frame.timed.at), frame_text(frame.timed.frame),
                        frame.from_host ? "" : meaning(frame.timed.frame, bus));
  }
  return text;
}

}  // namespace lk::emulator
