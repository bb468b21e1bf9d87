#include "tools/decode/decoder.hpp"

#include <algorithm>
#include <utility>

#include "emulator/core/generation.hpp"
#include "tools/decode/decode_output.hpp"

namespace lk::emulator {
namespace {

/// Returns `bus` with a drive at every ID. Added drives have the firmware and motor of `options`.
BusConfig every_drive(const DecodeOptions& options, protocol::Framing framing, BusConfig bus = {}) {
  for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) {
    if (std::ranges::count(bus.servos, id, &ServoConfig::id) > 0) continue;
    ServoConfig servo;
    servo.id = id;
    servo.profile = options.profile;
    servo.generation = options.generation;
    servo.quirks = quirks_of(options.generation, framing);
    bus.servos.push_back(std::move(servo));
  }
  return bus;
}

/// Returns true if a state 1 has non-zero bytes that are 0 in the layout
/// (docs/reference/protocol.md §10.1).
bool is_odd(const protocol::Payload& data, protocol::State1Layout layout) {
  switch (layout) {
    case protocol::State1Layout::kDeciVolt:
      return (data[2] | data[5] | data[6]) != 0;
    case protocol::State1Layout::kCentiVolt:
      return (data[4] | data[5] | data[6]) != 0;
    case protocol::State1Layout::kCentiVoltAndBusCurrent:
      return (data[6] & 0xEFU) != 0;
  }
  return false;
}

}  // namespace

Decoder::Decoder(DecodeOptions options)
    : options_(std::move(options)),
      readers_{FrameReader(every_drive(options_, protocol::Framing::kCan)),
               FrameReader(every_drive(options_, protocol::Framing::kSerial))} {
  for (const BusConfig& bus : options_.buses) {
    const auto framing = bus.serial ? protocol::Framing::kSerial : protocol::Framing::kCan;
    recorded_drives_.emplace(bus.interface, every_drive(options_, framing, bus));
  }
}

std::string Decoder::take(std::string_view line) {
  ++lines_;
  const auto parsed = parse_candump_text(line);
  if (std::holds_alternative<NoFrame>(parsed)) return "";
  if (const auto* problem = std::get_if<std::string>(&parsed)) return refuse(*problem);
  const auto& shown = std::get<PrintedFrame>(parsed);
  if (!summary_.buses.contains(shown.line.interface) && summary_.buses.size() >= kMaxInterfaces) {
    return refuse("too many interfaces, max " + std::to_string(kMaxInterfaces));
  }
  BusTally& tally = summary_.buses[shown.line.interface];
  const auto readers = readers_of(shown.line.interface, protocol::framing_of(shown.line.frame));
  Conversation& talk =
      conversations_
          .try_emplace({shown.line.interface, protocol::framing_of(shown.line.frame)}, readers)
          .first->second;

  DecodedFrame frame{.line = lines_,
                     .interface = shown.line.interface,
                     .frame = shown.line.frame,
                     .at = stamps_.time_of(shown)};
  const std::string found = stamps_.steps() && !summary_.steps ? steps_found() : "";
  if (!first_at_) first_at_ = frame.at;
  if (frame.at) frame.since = *frame.at - *first_at_;
  frame.info = talk.classify({shown.line.frame, frame.at, from_host(shown.line.direction)});
  frame.words = read(frame.info, readers.front());
  ++summary_.frames;
  tally.count(frame.info, frame.words, frame.at);
  for (const QueryOutcome& settled : talk.take_outcomes()) tally.count(settled);
  const std::string odd = check_generation(frame.info);
  if (options_.json) return found + frame_json(frame);
  return notes(shown) + found + frame_line(frame, options_) + odd;
}

std::string Decoder::finish() {
  for (auto& [wire, talk] : conversations_) {
    talk.end();
    for (const QueryOutcome& settled : talk.take_outcomes())
      summary_.buses[wire.first].count(settled);
  }
  return options_.json ? summary_json(summary_, options_) : summary_text(summary_, options_);
}

/// Counts a line that is not a frame. Returns a report if it is the first.
std::string Decoder::refuse(const std::string& problem) {
  if (summary_.bad_lines++ > 0) return "";
  first_problem_ = "line " + std::to_string(lines_) + ": " + problem;
  return options_.json ? bad_line_json(lines_, problem) : bad_line(lines_, problem, options_);
}

/// Returns notes about the assumptions that this frame needs, each once per input.
std::string Decoder::notes(const PrintedFrame& shown) {
  std::string text;
  if (!std::exchange(noted_assumptions_, true)) {
    text += assumption_line(options_, protocol::framing_of(shown.line.frame));
  }
  if (!shown.has_stamp && !std::exchange(noted_no_stamps_, true)) {
    text +=
        note_line({"no time stamps, so no latencies and no rates: candump -t a, or -L, has them",
                   "没有时间戳，因此没有延迟和频率：candump -t a 或 -L 会给出时间戳"},
                  options_);
  }
  return text;
}

/// Handles the first sign that time stamps are differences: drops the latencies so far, because
/// their times were wrong.
std::string Decoder::steps_found() {
  summary_.steps = true;
  for (auto& [wire, talk] : conversations_) talk.forget_times();
  for (auto& [interface, tally] : summary_.buses) {
    for (auto& [key, command] : tally.commands) command.latency = {};
  }
  if (options_.json) return steps_json(lines_);
  return note_line({"time stamps are steps from line to line (candump -t d): the times above are "
                    "wrong, those below are sums",
                    "时间戳是相邻两行的间隔（candump -t d）：以上的时间不对，以下为累加所得"},
                   options_);
}

/// Counts a reply that does not fit the generation. Returns a report if it is the first.
std::string Decoder::check_generation(const FrameInfo& info) {
  const std::uint8_t command = info.frame.data[0];
  const bool state_1 = info.role == Role::kReply && (command == 0x9A || command == 0x9B);
  const auto layout =
      quirks_of(options_.generation, protocol::framing_of(info.frame)).dialect.state_1;
  if (!options_.buses.empty() || !state_1 || !is_odd(info.frame.data, layout) ||
      summary_.odd_states++ > 0) {
    return "";
  }
  return note_line({"this state 1 does not look like the generation: its voltage may be wrong; try "
                    "another --generation",
                    "这个状态 1 看上去不属于该固件代，电压可能不对：换一个 --generation 试试"},
                   options_);
}

std::span<const FrameReader> Decoder::readers_of(std::string_view interface,
                                                 protocol::Framing framing) const {
  const auto found = recorded_drives_.find(interface);
  if (found != recorded_drives_.end()) return {&found->second, 1};
  return std::span(readers_).subspan(static_cast<std::size_t>(framing), 1);
}

FrameWords Decoder::read(const FrameInfo& info, const FrameReader& reader) {
  const bool error = info.frame.kind == protocol::FrameKind::kError;
  return error || info.role == Role::kReply ? reader.reply(info.frame) : reader.query(info.frame);
}

}  // namespace lk::emulator
