// Reads [[send]]: frames of a scenario's host.

#include "emulator/config/scenario/config_send.hpp"

#include <algorithm>

#include "emulator/config/candump_log.hpp"
#include "emulator/config/events/config_directives.hpp"
#include "emulator/config/scenario/config_scenario.hpp"
#include "emulator/core/frame_text.hpp"

namespace lk::emulator {
namespace {

/// Reads when and how often a frame is sent.
void read_repetition(TableReader& reader, SimTime duration, HostSend& send) {
  const auto every = read_duration(reader, "every_s");
  const auto until = read_moment(reader, "until_s", duration);
  const auto times = reader.integer("times", 1, 1'000'000'000);
  if (!every) {
    for (const char* key : {"until_s", "times"}) {
      if (reader.has(key)) reader.fail(key, "belongs to every_s");
    }
    return;
  }
  if (*every < std::chrono::microseconds(10)) {
    reader.fail("every_s", "must be at least 0.00001; no bus carries more");
  }
  if (until && times) reader.fail("until_s", "does not go together with times");
  const SimTime last = until.value_or(duration);
  if (last < send.at) reader.fail("until_s", "is before at_s");
  send.every = *every;
  send.times = static_cast<std::uint64_t>((last - send.at) / *every) + 1;
  if (times) send.times = std::min(send.times, static_cast<std::uint64_t>(*times));
}

/// Reads the hosts' frames of a log: all except those marked as received, which drives sent.
std::vector<HostSend> read_play(TableReader& reader, const Scenario& scenario,
                                const ScenarioFiles& files) {
  const std::string name = *reader.text("play");
  const SimTime from = read_moment(reader, "from_s", scenario.duration).value_or(SimTime{0});
  const auto interface = reader.text("interface");
  const std::size_t bus = read_bus_of(reader, scenario.robot, std::nullopt);
  reader.finish();
  std::vector<CandumpLine> log;
  try {
    log = parse_candump_log(files.text(name), name);
  } catch (const ConfigError&) {
    throw;
  } catch (const std::exception& problem) {
    reader.fail("play", problem.what());
  }
  std::vector<HostSend> sends;
  std::optional<SimTime> first;
  for (const CandumpLine& line : log) {
    if (interface && line.interface != *interface) continue;
    first = first.value_or(line.at);
    if (line.direction == CandumpLine::Direction::kReceived) continue;
    if (line.at < *first) reader.fail("play", "the times of " + name + " go back");
    const SimTime since = line.at - *first;  // may be centuries: `from + since` could overflow
    if (since <= scenario.duration - from) sends.push_back({bus, from + since, line.frame});
  }
  if (sends.empty()) reader.fail("play", name + " has no frame of a host to play");
  return sends;
}

/// Reads the key `frame`; nullopt if absent, as the frame is then given by `command`.
std::optional<protocol::Frame> read_raw(TableReader& reader) {
  const auto text = reader.text("frame");
  if (!text) return std::nullopt;
  const auto parsed = parse_frame(*text);
  if (const auto* problem = std::get_if<std::string>(&parsed)) reader.fail("frame", *problem);
  for (const char* key : {"id", "ids", "command"}) {
    if (reader.has(key)) reader.fail(key, "does not go together with frame");
  }
  return std::get<protocol::Frame>(parsed);
}

/// Returns one frame for each drive in `id` or `ids`; for each drive of the bus if both are absent.
std::vector<protocol::Frame> read_words(TableReader& reader, const BusConfig& bus) {
  std::vector<protocol::Frame> frames;
  for (const int id : read_targets(reader, bus)) {
    frames.push_back(read_query(reader, *find_servo(bus, id)));
  }
  return frames;
}

/// Returns the ID that determines the bus: that of the raw frame, or the first of `id` or `ids`;
/// nullopt if there is none.
std::optional<int> drive_meant(TableReader& reader, const Scenario& scenario) {
  const auto frame = read_raw(reader);
  if (!frame) {
    const std::vector<int> ids = read_ids(reader);
    return ids.empty() ? std::nullopt : std::optional(ids.front());
  }
  const int id = protocol::drive_at(frame->id, protocol::kSingleDriveId);
  const bool known =
      !frame->extended && std::ranges::any_of(scenario.robot, [id](const BusConfig& bus) {
        return find_servo(bus, id) != nullptr;
      });
  return known ? std::optional(id) : std::nullopt;
}

}  // namespace

std::vector<protocol::Frame> read_frames(TableReader& reader, const BusConfig& bus) {
  const auto frame = read_raw(reader);
  if (frame && protocol::is_serial(*frame) != bus.serial.has_value()) {
    reader.fail("frame", bus.serial ? "is not an RS-485 frame; write it like rs485#3E9A0100D9"
                                    : "is not a CAN frame; write it like 141#9C00000000000000");
  }
  return frame ? std::vector{*frame} : read_words(reader, bus);
}

std::vector<HostSend> read_send(TableReader& reader, const Scenario& scenario,
                                const ScenarioFiles& files) {
  if (reader.has("play")) return read_play(reader, scenario, files);
  const SimTime at = reader.required("at_s", read_moment(reader, "at_s", scenario.duration));
  const std::size_t bus = read_bus_of(reader, scenario.robot, drive_meant(reader, scenario));
  std::vector<HostSend> sends;
  for (const protocol::Frame& frame : read_frames(reader, scenario.robot[bus])) {
    sends.push_back({.bus = bus, .frame = frame});
  }
  for (HostSend& send : sends) {
    send.at = at;
    read_repetition(reader, scenario.duration, send);
  }
  reader.finish();
  return sends;
}

}  // namespace lk::emulator
