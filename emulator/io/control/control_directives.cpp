#include "emulator/io/control/control_directives.hpp"

#include <algorithm>
#include <optional>

#include "emulator/config/events/config_directives.hpp"
#include "emulator/config/scenario/config_send.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/frame_text.hpp"
#include "emulator/core/wire/can_wire.hpp"
#include "emulator/io/control/control_api.hpp"
#include "emulator/io/control/control_json.hpp"

namespace lk::emulator {
namespace {

/// Configuration with the present RAM settings, which hold where a request gives no value.
BusConfig current_config(const Line& line) {
  BusConfig now = line.config();
  for (ServoConfig& servo : now.servos) servo.rom = line.bus().servo(servo.id).ram;
  return now;
}

void check_fault(const Line& line) {
  if (line.bus().state().faults.full()) {
    throw ApiError(409, "fault",
                   "this bus has " + std::to_string(Bus::kMaxFaults) +
                       " unfinished faults, the limit; clear some");
  }
}

/// Returns whether an active or armed fault of the bus delays frames in the hosts' adapter.
bool delays_in_adapter(const Line& line) {
  using enum FaultEvidence::State;
  const std::vector<FaultReport> faults = line.bus().faults();
  return std::ranges::any_of(faults, [](const FaultReport& report) {
    const bool is_over = report.evidence.state == kOver || report.evidence.state == kCleared;
    return !is_over && lk::emulator::delays_in_adapter(*report.fault.row);
  });
}

void check_clear(const ClearFault& clear, const Line& line) {
  if (clear.which == "all" || clear.which == kPlanned || find_fault(clear.which) != nullptr) return;
  const auto faults = line.bus().faults();
  const bool known = std::ranges::any_of(
      faults, [&](const FaultReport& report) { return report.fault.name == clear.which; });
  if (!known) throw ApiError(400, "clear", "unknown fault \"" + clear.which + "\"");
}

/// Tries immediate settings on a copy of the bus: a flash queues a limited number of writes.
void check_settings(const std::vector<TimedDirective>& directives, const Line& line) {
  std::optional<Bus> trial;
  for (const TimedDirective& directive : directives) {
    const auto* const setting = std::get_if<Setting>(&directive.directive.what);
    if (setting == nullptr || directive.when || directive.at > line.bus().time()) continue;
    const int id = directive.directive.id;
    if (!line.bus().telemetry(id).alive) {
      throw ApiError(
          409, "settings",
          "drive " + std::to_string(id) + " has no power; settings need a powered drive");
    }
    if (!trial) trial = line.bus();
    if (!trial->write_setting(id, setting->parameter, setting->value)) {
      throw ApiError(409, "settings",
                     "the flash of drive " + std::to_string(id) +
                         " has too many pending writes; try again later");
    }
  }
}

/// Limits directives that wait for a time; faults have their own limit.
void check_planned(const std::vector<TimedDirective>& directives, const Line& line) {
  const auto wanted = std::ranges::count_if(directives, [&](const TimedDirective& directive) {
    return !directive.when && directive.at > line.bus().time() &&
           !std::holds_alternative<SetFault>(directive.directive.what);
  });
  if (wanted == 0) return;
  if (line.bus().state().agenda.directives() + static_cast<std::size_t>(wanted) > kMaxPlanned) {
    throw ApiError(409, "at_s",
                   "a bus holds at most " + std::to_string(kMaxPlanned) +
                       " planned directives; remove them with clear = \"planned\"");
  }
}

/// Rejects more conditions than the bus can wait for, before any of them is armed.
void check_places(const std::vector<TimedDirective>& directives, const Line& line) {
  const auto waits = [](const TimedDirective& directive) { return directive.when.has_value(); };
  const auto wanted = static_cast<std::size_t>(std::ranges::count_if(directives, waits));
  if (wanted == 0) return;
  const std::vector<FaultReport> faults = line.bus().faults();
  const auto armed = static_cast<std::size_t>(std::ranges::count(
      faults, FaultEvidence::State::kArmed, [](const auto& one) { return one.evidence.state; }));
  // Some armed faults wait for a time, not for a condition: this refuses too early, never too late.
  if (line.bus().state().conditions.directives() + armed + wanted > Bus::kMaxWaiting) {
    throw ApiError(409, "when",
                   "a bus holds at most " + std::to_string(Bus::kMaxWaiting) +
                       " conditions: clear some faults");
  }
}

/// Reads and checks only.
std::vector<TimedDirective> read_request(const Json& request, const Line& line) {
  const toml::table table = to_table(request);
  TableReader reader(table, "request", "");
  auto directives = read_directives(reader, current_config(line), Timing::kOptional);
  for (const TimedDirective& directive : directives) {
    const auto& what = directive.directive.what;
    if (const auto* set = std::get_if<SetFault>(&what)) {
      check_fault(line);
      check_adapter(reader, *set->fault.row, line.config(), delays_in_adapter(line));
    }
    if (const auto* clear = std::get_if<ClearFault>(&what)) check_clear(*clear, line);
  }
  check_settings(directives, line);
  check_planned(directives, line);
  check_places(directives, line);
  return directives;
}

/// Executes or plans the directives; returns the names of new faults.
std::vector<std::string> perform_all(const std::vector<TimedDirective>& directives, Line& line) {
  std::vector<std::string> names;
  for (const TimedDirective& directive : directives) {
    if (line.perform(directive) && std::holds_alternative<SetFault>(directive.directive.what)) {
      names.push_back(line.bus().faults().back().fault.name);
    }
  }
  return names;
}

}  // namespace

std::vector<std::string> request_all(const Json& request, Line& line) {
  const auto directives = read_request(request, line);
  line.announce(request.dump());
  return perform_all(directives, line);
}

Json send_frames(const Json& request, Line& line) {
  const toml::table table = to_table(request);
  TableReader reader(table, "request", "");
  const auto frames = read_frames(reader, line.config());
  reader.finish();
  const Bus& bus = line.bus();
  if (bus.stats().frames_waiting + frames.size() > CanWire::kHostQueue ||
      bus.state().wire.host_queue_full() || line.backlog() > 0) {
    throw ApiError(
        409, "frame",
        "too many frames are queued; wait until the bus has sent them, or advance the clock");
  }
  Json texts = Json::array();
  for (const protocol::Frame& frame : frames) {
    line.accept({bus.time(), frame});
    texts.push_back(frame_text(frame));
  }
  return {{"time_s", in_seconds(bus.time())}, {"frames", texts}};
}

}  // namespace lk::emulator
