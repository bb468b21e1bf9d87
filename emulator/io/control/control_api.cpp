#include "emulator/io/control/control_api.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>

#include "emulator/config/events/config_directives.hpp"
#include "emulator/config/scenario/config_send.hpp"
#include "emulator/core/bus/wire.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/frame_text.hpp"
#include "emulator/core/text.hpp"
#include "emulator/io/control/control_json.hpp"
#include "emulator/io/control/http_access.hpp"
#include "emulator/io/control/streams.hpp"

namespace lk::emulator {
namespace {

using Parts = std::vector<std::string>;

Parts split(std::string_view text, char by) {
  Parts parts;
  for (;;) {
    const std::size_t end = text.find(by);
    parts.emplace_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

/// Returns whether `path` matches `pattern`; stores the parts that match its {…} in `parts`.
bool matches(std::string_view pattern, const Parts& path, Parts& parts) {
  const Parts wanted = split(pattern, '/');
  if (wanted.size() != path.size()) return false;
  parts.clear();
  for (std::size_t n = 0; n < wanted.size(); ++n) {
    if (wanted[n].starts_with('{')) {
      parts.push_back(path[n]);
    } else if (wanted[n] != path[n]) {
      return false;
    }
  }
  return true;
}

bool has_body(const ApiRequest& request) {
  return request.method == "POST" || request.method == "PUT";
}

void check_content_type(const ApiRequest& request) {
  if (!has_body(request)) return;
  const std::string type = request.content_type.substr(0, request.content_type.find(';'));
  if (type != "application/json") {
    throw ApiError(415, "Content-Type", "must be application/json");
  }
}

void check_may_write(const ApiRequest& request) {
  if (request.method == "GET" || request.pages_may_write) return;
  if (request.from_page) {
    throw ApiError(403, "Origin",
                   "web pages are read-only; to allow changes, start lk-emu with --http-write");
  }
  if (request.is_public) {
    throw ApiError(403, "method",
                   "clients without a token are read-only; to allow changes, start lk-emu with "
                   "--http-write or --http-token FILE");
  }
}

/// Refuses recordings to clients without a token, unless only this user can connect. A recording
/// creates a directory at any path that the program may write.
void check_may_record(const ApiRequest& request) {
  if (request.same_user || request.has_token) return;
  throw ApiError(403, "recording",
                 "writes files: begin it over the Unix socket (lk-emu ctl record), or start lk-emu "
                 "with a --http-token FILE or --record");
}

/// Rejects query parameters, except for streams, which check them.
void check_query(const ApiRequest& request, std::string_view route) {
  if (request.query.empty() || route == "/telemetry" || route == "/frames") return;
  if (route == "/drives" && request.query.begin()->first == "fields" && request.query.size() == 1)
    return;
  throw ApiError(400, request.query.begin()->first, "unknown; this request has no parameters");
}

void check_clock_is_free(const World& world) {
  if (!world.clock_owner.empty()) throw ApiError(409, "clock", world.clock_owner);
}

/// Sets the clock to the mode under `key`. Throws if `key` is missing, or other keys are present.
void set_clock(const ApiCall& call, const char* key) {
  const std::string word = call.body.required(key, call.body.text(key));
  call.body.finish();
  const auto mode = parse_clock_mode(word);
  if (!mode) {
    call.body.fail(key, "\"" + word + "\" is not one of realtime, stepped, x0.001 to x1000");
  }
  check_clock_is_free(call.world);
  call.world.set_clock(*mode);
}

}  // namespace

ApiResponse error_response(int status, const std::string& where, const std::string& reason) {
  return {status, {{"error", {{"where", where}, {"reason", reason}}}}, ""};
}

Line& line_of(World& world, const std::string* bus) {
  if (bus != nullptr) {
    if (Line* const line = find_line(world, *bus)) return *line;
    throw ApiError(400, "bus", "unknown bus " + *bus);
  }
  if (world.lines().size() > 1) throw ApiError(400, "bus", "missing; there are several buses");
  return *world.lines().front();
}

namespace {

/// Returns the line that the request's body names as "bus"; without it, the only line.
Line& named_line(const ApiCall& call) {
  const auto bus = call.body.text("bus");
  return line_of(call.world, bus ? &*bus : nullptr);
}

// --- reads

Json clock_json(const World& world) {
  return {{"mode", to_string(world.clock().mode())},
          {"time_s", in_seconds(world.time())},
          {"slipped_s", in_seconds(world.clock().total_slip())},
          {"advancing", world.advancing()}};
}

void get_status(const ApiCall& call) {
  call.world.serve_all();
  Json buses = Json::array();
  for (const auto& line : call.world.lines()) buses.push_back(bus_json(*line));
  call.reply({200,
              {{"version", LKEMU_VERSION},
               {"pid", ::getpid()},
               {"clock", clock_json(call.world)},
               {"buses", buses},
               {"body", drawable_body(call.world) != nullptr},
               {"recording", call.api.recording.state ? call.api.recording.state() : Json(nullptr)},
               {"scenario", call.api.scenario.state ? call.api.scenario.state() : Json(nullptr)},
               {"pages_may_write", call.request.pages_may_write}},
              ""});
}

/// Returns the keys of `drive` that the list `fields` names.
Json chosen_fields(const Json& drive, std::string_view fields) {
  Json chosen;
  for (std::string_view rest = fields; !rest.empty();) {
    const std::size_t end = std::min(rest.find(','), rest.size());
    const std::string name(rest.substr(0, end));
    if (!drive.contains(name)) throw ApiError(400, "fields", "unknown field \"" + name + "\"");
    chosen[name] = drive[name];
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return chosen;
}

void get_drives(const ApiCall& call) {
  call.world.serve_all();
  const auto fields = call.request.query.find("fields");
  Json drives = Json::array();
  for (const auto& line : call.world.lines()) {
    for (const ServoConfig& servo : line->config().servos) {
      const Json drive = drive_json(*line, servo.id);
      drives.push_back(fields == call.request.query.end() ? drive
                                                          : chosen_fields(drive, fields->second));
    }
  }
  call.reply({200, drives, ""});
}

void get_drive(const ApiCall& call) {
  call.world.serve_all();
  const std::string bus = decode_percent(call.parts[0], "path");
  const Line* const line = find_line(call.world, bus);
  if (line == nullptr) throw ApiError(404, "path", "unknown bus " + bus);
  const auto number = number_of(call.parts[1], 10, protocol::kMaxId);
  const int id = static_cast<int>(number.value_or(0));
  if (!line->bus().has(id)) {
    throw ApiError(404, "path", "no drive " + call.parts[1] + " on " + bus);
  }
  call.reply({200, drive_json(*line, id), ""});
}

void get_advice(const ApiCall& call) {
  call.world.serve_all();
  Json all = Json::array();
  for (const auto& line : call.world.lines()) {
    for (const Advice& advice : line->adviser().advice()) all.push_back(advice_json(*line, advice));
  }
  call.reply({200, all, ""});
}

void get_faults(const ApiCall& call) {
  call.world.serve_all();
  Json faults = Json::array();
  for (const auto& line : call.world.lines()) {
    for (const FaultReport& report : line->bus().faults()) {
      faults.push_back(fault_json(*line, report));
    }
  }
  call.reply({200, faults, ""});
}

void get_fault_kinds(const ApiCall& call) {
  call.world.serve_all();
  call.reply({200, fault_kinds_json(), ""});
}

void get_signals(const ApiCall& call) {
  call.world.serve_all();
  call.reply({200, signals_json(call.world), ""});
}

// --- writes

/// Returns whether an active or armed fault of the bus delays frames in the hosts' adapter.
bool delays_frames(const FaultBoard& faults) {
  return std::ranges::any_of(faults, [](const LiveFault& live) {
    return !live.is_over() && delays_in_adapter(live.row());
  });
}

void check_clear(const ClearFault& clear, const FaultBoard& faults) {
  if (clear.which == "all" || clear.which == kPlanned || find_fault(clear.which) != nullptr) return;
  const auto name = [](const LiveFault& live) { return live.fault.name; };
  if (std::ranges::find(faults, clear.which, name) != faults.end()) return;
  throw ApiError(400, "clear", "unknown fault \"" + clear.which + "\"");
}

/// Rejects immediate settings that a drive cannot store: it has no power, or its flash has too many
/// queued writes.
void check_settings(const std::vector<TimedDirective>& directives, const Bus& bus) {
  std::map<int, std::size_t> writes;
  for (const auto& [at, directive, when, source] : directives) {
    if (!std::holds_alternative<Setting>(directive.what) || when || at > bus.time()) continue;
    const int id = directive.id;
    if (!bus.telemetry(id).alive) {
      throw ApiError(
          409, "settings",
          "drive " + std::to_string(id) + " has no power; settings need a powered drive");
    }
    if (bus.state().nodes.of(id).memory.size() + writes[id]++ < Wire::kDriveQueue) continue;
    throw ApiError(409, "settings",
                   "the flash of drive " + std::to_string(id) +
                       " has too many pending writes; try again later");
  }
}

/// Throws if the bus has no room for all these faults, conditions and directives planned for a
/// time.
void check_room(const std::vector<TimedDirective>& directives, const Bus& bus) {
  const BusState& state = bus.state();
  std::size_t planned = 0;
  std::size_t conditions = 0;
  for (const TimedDirective& directive : directives) {
    const bool is_fault = std::holds_alternative<SetFault>(directive.directive.what);
    if (is_fault && state.faults.full()) {
      throw ApiError(409, "fault",
                     "this bus has " + std::to_string(Bus::kMaxFaults) +
                         " unfinished faults, the limit; clear some");
    }
    if (directive.when) {
      ++conditions;
    } else if (directive.at > bus.time() && !is_fault) {
      ++planned;
    }
  }
  if (planned > 0 && state.agenda.directives() + planned > kMaxPlanned) {
    throw ApiError(409, "at_s",
                   "a bus holds at most " + std::to_string(kMaxPlanned) +
                       " planned directives; remove them with clear = \"planned\"");
  }
  // Also counts armed faults that wait for a time, not a condition: may refuse before the limit.
  const auto armed = static_cast<std::size_t>(
      std::ranges::count(state.faults, FaultEvidence::State::kArmed,
                         [](const auto& one) { return one.evidence.state; }));
  if (conditions > 0 && state.conditions.directives() + armed + conditions > Bus::kMaxWaiting) {
    throw ApiError(409, "when",
                   "a bus holds at most " + std::to_string(Bus::kMaxWaiting) +
                       " conditions: clear some faults");
  }
}

/// Executes or plans directives, and notifies listeners. Checks all directives first, so that an
/// invalid one leaves no effect.
void post_directives(const ApiCall& call) {
  if (call.body.has("clock")) {  // the only directive without a bus
    set_clock(call, "clock");
    return call.reply(
        {200, {{"time_s", in_seconds(call.world.time())}, {"faults", Json::array()}}, ""});
  }
  Line& line = named_line(call);
  call.world.serve_all();
  const Bus& bus = line.bus();
  const auto directives = read_directives(call.body, line.config(), Timing::kOptional, &bus);
  for (const TimedDirective& directive : directives) {
    const auto& what = directive.directive.what;
    if (const auto* set = std::get_if<SetFault>(&what)) {
      check_adapter(call.body, set->fault, line.config(), delays_frames(bus.state().faults));
    }
    if (const auto* clear = std::get_if<ClearFault>(&what)) {
      check_clear(*clear, bus.state().faults);
    }
  }
  check_settings(directives, bus);
  check_room(directives, bus);
  line.announce(call.body.as_json({"bus"}));
  Json faults = Json::array();
  for (const TimedDirective& directive : directives) {
    if (line.perform(directive) && std::holds_alternative<SetFault>(directive.directive.what)) {
      faults.push_back(bus.faults().back().fault.name);
    }
  }
  call.reply({200, {{"time_s", in_seconds(bus.time())}, {"faults", faults}}, ""});
}

void delete_directives(const ApiCall& call) {
  call.world.serve_all();
  for (const auto& line : call.world.lines()) request_clear(*line, std::string(kPlanned));
  call.reply({200, {{"time_s", in_seconds(call.world.time())}}, ""});
}

/// Sends frames as a host does. Their keys are those of a scenario's [[send]], without its times.
void post_frames(const ApiCall& call) {
  Line& line = named_line(call);
  call.world.serve_all();
  const auto frames = read_frames(call.body, line.config());
  call.body.finish();
  const Bus& bus = line.bus();
  const std::size_t room =
      line.config().serial ? Line::kMaxSpaced : line.config().host_queue.frames;
  if (bus.stats().frames_waiting + line.backlog() + frames.size() > room ||
      bus.state().wire.host_queue_full()) {
    throw ApiError(
        409, "frame",
        "too many frames are queued; wait until the bus has sent them, or advance the clock");
  }
  Json texts = Json::array();
  for (const protocol::Frame& frame : frames) {
    line.accept_in_turn({bus.time(), frame});
    texts.push_back(frame_text(frame));
  }
  call.reply({200, {{"time_s", in_seconds(bus.time())}, {"frames", texts}}, ""});
}

void get_clock(const ApiCall& call) {
  call.world.serve_all();
  call.reply({200, clock_json(call.world), ""});
}

void put_clock(const ApiCall& call) {
  set_clock(call, "mode");
  call.reply({200, clock_json(call.world), ""});
}

void post_advance(const ApiCall& call) {
  TableReader& reader = call.body;
  const auto by = read_duration(reader, "by_s");
  const auto to = read_duration(reader, "to_s");
  if (by && to) reader.fail("to_s", "give either by_s or to_s");
  if (!by && !to) reader.note_missing("by_s");
  reader.finish();
  check_clock_is_free(call.world);
  if (!call.world.clock().mode().stepped) {
    throw ApiError(409, "clock",
                   "the clock mode is " + to_string(call.world.clock().mode()) +
                       "; to advance the time by hand, set it to stepped");
  }
  if (call.world.advancing()) throw ApiError(409, "clock", "another advance is running");
  const SimTime now = call.world.clock().stepped_time();
  const SimTime target = std::chrono::round<std::chrono::microseconds>(by ? now + *by : *to);
  if (target < now)
    reader.fail("to_s", "is in the past; the time is " + std::to_string(in_seconds(now)) + " s");
  call.world.advance(target, [&world = call.world, reply = call.reply](World::Advanced how) {
    const Json time_s = in_seconds(world.time());
    switch (how) {
      case World::Advanced::kReached:
        return reply({200, {{"time_s", time_s}}, ""});
      case World::Advanced::kCancelled:
        return reply(error_response(409, "clock", "cancelled at " + time_s.dump() + " s"));
      case World::Advanced::kStuck:
        return reply(error_response(
            503, "clock",
            "stuck: the disk or an interface does not accept the replies; the time is " +
                time_s.dump() + " s"));
    }
  });
}

void delete_advance(const ApiCall& call) {
  call.world.end_advance();
  call.reply({200, {{"time_s", in_seconds(call.world.time())}}, ""});
}

ApiResponse absent(const char* what) {
  return error_response(501, what, std::string("this lk-emu has no ") + what);
}

void post_recording(const ApiCall& call) {
  if (!call.api.recording.start) return call.reply(absent("recording"));
  check_may_record(call.request);
  call.reply({200, call.api.recording.start(call.body, call.request.same_user), ""});
}

void delete_recording(const ApiCall& call) {
  if (!call.api.recording.stop) return call.reply(absent("recording"));
  call.reply({200, call.api.recording.stop(), ""});
}

void post_scenario(const ApiCall& call) {
  if (!call.api.scenario.start) return call.reply(absent("scenario"));
  call.reply({200, call.api.scenario.start(call.body, call.request.same_user), ""});
}

void get_scenario(const ApiCall& call) {
  if (!call.api.scenario.report) return call.reply(absent("scenario"));
  call.world.serve_all();
  call.reply({200, call.api.scenario.report(), ""});
}

void delete_scenario(const ApiCall& call) {
  if (!call.api.scenario.stop) return call.reply(absent("scenario"));
  call.reply({200, call.api.scenario.stop(), ""});
}
void get_scenarios(const ApiCall& call) {
  call.world.serve_all();
  call.reply({200, scenarios_json(), ""});
}

}  // namespace

void request_clear(Line& line, const std::string& which) {
  line.announce(Json{{"clear", which}}.dump());
  line.perform({line.bus().time(), {kWholeBus, ClearFault{which}}});
}

std::span<const ApiRoute> ControlApi::routes() {
  static constexpr ApiRoute kRoutes[] = {
      {"GET", "/status", &get_status},
      {"GET", "/drives", &get_drives},
      {"GET", "/drives/{bus}/{id}", &get_drive},
      {"POST", "/directives", &post_directives},
      {"DELETE", "/directives", &delete_directives},
      {"GET", "/advice", &get_advice},
      {"GET", "/faults", &get_faults},
      {"GET", "/faults/kinds", &get_fault_kinds},
      {"GET", "/signals", &get_signals},
      {"GET", "/clock", &get_clock},
      {"PUT", "/clock", &put_clock},
      {"POST", "/clock/advance", &post_advance},
      {"DELETE", "/clock/advance", &delete_advance},
      {"POST", "/recording", &post_recording},
      {"DELETE", "/recording", &delete_recording},
      {"POST", "/scenario", &post_scenario},
      {"GET", "/scenario", &get_scenario},
      {"DELETE", "/scenario", &delete_scenario},
      {"GET", "/scenarios", &get_scenarios},
      {"GET", "/telemetry", &get_telemetry},
      {"GET", "/body", &get_body},
      {"GET", "/frames", &get_frames},
      {"POST", "/frames", &post_frames},
  };
  return kRoutes;
}

void ControlApi::handle(const ApiRequest& request, const ApiReply& reply) {
  try {
    std::string_view path = request.path;
    const bool below_base =
        path.starts_with(kBasePath) && path.substr(kBasePath.size()).starts_with('/');
    check_may_write(request);
    if (!below_base) throw ApiError(404, "path", "not found; the API is below /api/v1");
    const Parts asked = split(path.substr(kBasePath.size()), '/');
    std::string allowed;
    for (const ApiRoute& route : routes()) {
      Parts parts;
      if (!matches(route.path, asked, parts)) continue;
      if (route.method == request.method) {
        check_content_type(request);
        check_query(request, route.path);
        // Shutting down: refuse writes.
        if (world_.stopped() && request.method != "GET") {
          throw ApiError(503, "lk-emu", "the program is ending");
        }
        const auto table = has_body(request) ? parse_json_table(request.body) : toml::table();
        TableReader body(table, "request", "");
        route.handle({*this, world_, request, parts, reply, body});
        return;
      }
      allowed += (allowed.empty() ? "" : ", ") + std::string(route.method);
      if (route.method == "GET") allowed += ", HEAD";
    }
    if (allowed.empty()) throw ApiError(404, "path", "not found");
    ApiResponse response = error_response(405, "method", "method not allowed; allowed: " + allowed);
    response.allow = allowed;
    reply(response);
  } catch (const ApiError& problem) {
    reply(error_response(problem.status, problem.where, problem.what()));
  } catch (const JsonError& problem) {
    reply(error_response(400, problem.where, problem.what()));
  } catch (const ConfigError& problem) {
    const std::string line = problem.line > 0 ? "line " + std::to_string(problem.line) + ": " : "";
    reply(error_response(400, problem.key.empty() ? problem.file : problem.key,
                         line + problem.reason));
  } catch (const std::exception& problem) {
    spdlog::error("control: {} {}: {}", request.method, request.path, problem.what());
    reply(error_response(500, "lk-emu", problem.what()));
  }
}

}  // namespace lk::emulator
