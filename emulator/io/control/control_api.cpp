#include "emulator/io/control/control_api.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <charconv>

#include "emulator/config/events/config_directives.hpp"
#include "emulator/io/control/body_stream.hpp"
#include "emulator/io/control/control_directives.hpp"
#include "emulator/io/control/control_json.hpp"
#include "emulator/io/control/http_access.hpp"

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

Json body_of(const ApiRequest& request) {
  Json json = parse_json(request.body);
  if (!json.is_object()) throw ApiError(400, "body", "must be a JSON object");
  return json;
}

void check_content_type(const ApiRequest& request) {
  if (request.method != "POST" && request.method != "PUT") return;
  const std::string type = request.content_type.substr(0, request.content_type.find(';'));
  if (type != "application/json") {
    throw ApiError(415, "Content-Type", "must be application/json");
  }
}

void check_may_write(const ApiRequest& request) {
  if (request.method == "GET" || request.pages_may_write) return;
  if (request.from_page) {
    throw ApiError(403, "Origin", "a page may only look: start lk-emu with --http-write");
  }
  if (request.is_public) {
    throw ApiError(403, "method",
                   "without a token one may only look: start lk-emu with --http-write, or with a "
                   "--http-token FILE");
  }
}

/// Recording creates a directory wherever the program may. A client without a token may be anyone.
void check_may_record(const ApiRequest& request) {
  if (request.same_user || request.has_token) return;
  throw ApiError(403, "recording",
                 "writes files: begin it over the Unix socket (lk-emu ctl record), or start lk-emu "
                 "with a --http-token FILE or --record");
}

/// Rejects parameters; streams check their own.
void check_query(const ApiRequest& request, std::string_view route) {
  if (request.query.empty() || route == "/telemetry" || route == "/frames") return;
  throw ApiError(400, request.query.begin()->first, "unknown; this request has no parameters");
}

void check_clock_is_free(const World& world) {
  if (!world.clock_owner.empty()) throw ApiError(409, "clock", world.clock_owner);
}

/// Reads the mode at the required `key`.
ClockMode read_clock(TableReader& reader, const std::string& key) {
  const auto word = reader.text(key);
  if (!word) {
    reader.note_missing(key);
    reader.finish();
    return {};
  }
  const auto mode = parse_clock_mode(*word);
  if (!mode) reader.fail(key, "\"" + *word + "\" is not one of realtime, stepped, x0.001 to x1000");
  return *mode;
}

}  // namespace

ApiResponse error_response(int status, const std::string& where, const std::string& reason) {
  return {status, {{"error", {{"where", where}, {"reason", reason}}}}, ""};
}

std::span<const ControlApi::Route> ControlApi::routes() {
  static constexpr Route kRoutes[] = {
      {"GET", "/status", &ControlApi::get_status},
      {"GET", "/drives", &ControlApi::get_drives},
      {"GET", "/drives/{bus}/{id}", &ControlApi::get_drive},
      {"POST", "/directives", &ControlApi::post_directives},
      {"DELETE", "/directives", &ControlApi::delete_directives},
      {"GET", "/advice", &ControlApi::get_advice},
      {"GET", "/faults", &ControlApi::get_faults},
      {"GET", "/faults/kinds", &ControlApi::get_fault_kinds},
      {"GET", "/signals", &ControlApi::get_signals},
      {"GET", "/clock", &ControlApi::get_clock},
      {"PUT", "/clock", &ControlApi::put_clock},
      {"POST", "/clock/advance", &ControlApi::post_advance},
      {"DELETE", "/clock/advance", &ControlApi::delete_advance},
      {"POST", "/recording", &ControlApi::post_recording},
      {"DELETE", "/recording", &ControlApi::delete_recording},
      {"POST", "/scenario", &ControlApi::post_scenario},
      {"GET", "/scenario", &ControlApi::get_scenario},
      {"DELETE", "/scenario", &ControlApi::delete_scenario},
      {"GET", "/scenarios", &ControlApi::get_scenarios},
      {"GET", "/telemetry", &ControlApi::get_telemetry},
      {"GET", "/body", &ControlApi::get_body},
      {"GET", "/frames", &ControlApi::get_frames},
      {"POST", "/frames", &ControlApi::post_frames},
  };
  return kRoutes;
}

void ControlApi::handle(const ApiRequest& request, const Reply& reply) {
  try {
    std::string_view path = request.path;
    const bool below_base =
        path.starts_with(kBasePath) && path.substr(kBasePath.size()).starts_with('/');
    check_may_write(request);
    if (!below_base) throw ApiError(404, "path", "there is nothing here; the API is below /api/v1");
    const Parts asked = split(path.substr(kBasePath.size()), '/');
    std::string allowed;
    for (const Route& route : routes()) {
      Parts parts;
      if (!matches(route.path, asked, parts)) continue;
      if (route.method == request.method) {
        check_content_type(request);
        check_query(request, route.path);
        // Shutting down: refuse writes.
        if (world_.stopped() && request.method != "GET") {
          throw ApiError(503, "lk-emu", "the program is ending");
        }
        (this->*route.handle)(request, parts, reply);
        return;
      }
      allowed += (allowed.empty() ? "" : ", ") + std::string(route.method);
      if (route.method == "GET") allowed += ", HEAD";
    }
    if (allowed.empty()) throw ApiError(404, "path", "not found");
    ApiResponse response = error_response(405, "method", "this can be asked for by " + allowed);
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

Line& ControlApi::line_of(const std::string* bus) {
  if (bus != nullptr) {
    if (Line* const line = world_.find_line(*bus)) return *line;
    throw ApiError(400, "bus", "there is no bus " + *bus);
  }
  if (world_.lines().size() > 1) throw ApiError(400, "bus", "there are several; name one");
  return *world_.lines().front();
}

Line& ControlApi::take_bus(Json& body) {
  if (!body.contains("bus")) return line_of(nullptr);
  if (!body["bus"].is_string()) throw ApiError(400, "bus", "must be a string");
  const auto bus = body["bus"].get<std::string>();
  body.erase("bus");
  return line_of(&bus);
}

// --- reads

Json ControlApi::clock_json() const {
  return {{"mode", to_string(world_.clock().mode())},
          {"time_s", seconds(world_.time())},
          {"slipped_s", seconds(world_.clock().total_slip())},
          {"advancing", world_.advancing()}};
}

void ControlApi::get_status(const ApiRequest& request, const Parts& /*parts*/, const Reply& reply) {
  catch_up();
  Json buses = Json::array();
  for (const auto& line : world_.lines()) buses.push_back(bus_json(*line));
  reply({200,
         {{"version", LKEMU_VERSION},
          {"pid", ::getpid()},
          {"clock", clock_json()},
          {"buses", buses},
          {"body", drawable_body(world_) != nullptr},
          {"recording", recording.state ? recording.state() : Json(nullptr)},
          {"scenario", scenario.state ? scenario.state() : Json(nullptr)},
          {"pages_may_write", request.pages_may_write}},
         ""});
}

void ControlApi::get_drives(const ApiRequest& /*request*/, const Parts& /*parts*/,
                            const Reply& reply) {
  catch_up();
  Json drives = Json::array();
  for (const auto& line : world_.lines()) {
    for (const ServoConfig& servo : line->config().servos) {
      drives.push_back(drive_json(*line, servo.id));
    }
  }
  reply({200, drives, ""});
}

void ControlApi::get_drive(const ApiRequest& /*request*/, const Parts& parts, const Reply& reply) {
  catch_up();
  const std::string bus = decode_percent(parts[0], "path");
  const Line* const line = world_.find_line(bus);
  if (line == nullptr) throw ApiError(404, "path", "there is no bus " + bus);
  int id = 0;
  const char* const last = parts[1].data() + parts[1].size();
  const auto [end, error] = std::from_chars(parts[1].data(), last, id);
  if (error != std::errc() || end != last || !line->bus().has(id)) {
    throw ApiError(404, "path", "there is no drive " + parts[1] + " on " + bus);
  }
  reply({200, drive_json(*line, id), ""});
}

void ControlApi::get_advice(const ApiRequest& /*request*/, const Parts& /*parts*/,
                            const Reply& reply) {
  catch_up();
  Json all = Json::array();
  for (const auto& line : world_.lines()) {
    for (const Advice& advice : line->adviser().advice()) all.push_back(advice_json(*line, advice));
  }
  reply({200, all, ""});
}

void ControlApi::get_faults(const ApiRequest& /*request*/, const Parts& /*parts*/,
                            const Reply& reply) {
  catch_up();
  Json faults = Json::array();
  for (const auto& line : world_.lines()) {
    for (const FaultReport& report : line->bus().faults()) {
      faults.push_back(fault_json(*line, report));
    }
  }
  reply({200, faults, ""});
}

void ControlApi::get_fault_kinds(const ApiRequest& /*request*/, const Parts& /*parts*/,
                                 const Reply& reply) {
  catch_up();
  reply({200, fault_kinds_json(), ""});
}

void ControlApi::get_signals(const ApiRequest& /*request*/, const Parts& /*parts*/,
                             const Reply& reply) {
  catch_up();
  reply({200, signals_json(world_), ""});
}

// --- writes

void ControlApi::post_directives(const ApiRequest& request, const Parts& /*parts*/,
                                 const Reply& reply) {
  Json body = body_of(request);
  if (body.contains("clock")) {  // the only directive without a bus
    const toml::table table = to_table(body);
    TableReader reader(table, "request", "");
    const ClockMode mode = read_clock(reader, "clock");
    reader.finish();
    check_clock_is_free(world_);
    world_.set_clock(mode);
    return reply({200, {{"time_s", seconds(world_.time())}, {"faults", Json::array()}}, ""});
  }
  Line& line = take_bus(body);
  catch_up();
  const auto names = request_all(body, line);
  reply({200, {{"time_s", seconds(line.bus().time())}, {"faults", names}}, ""});
}

void ControlApi::post_frames(const ApiRequest& request, const Parts& /*parts*/,
                             const Reply& reply) {
  Json body = body_of(request);
  Line& line = take_bus(body);
  catch_up();
  reply({200, send_frames(body, line), ""});
}

void ControlApi::delete_directives(const ApiRequest& /*request*/, const Parts& /*parts*/,
                                   const Reply& reply) {
  catch_up();
  for (const auto& line : world_.lines()) request_all({{"clear", kPlanned}}, *line);
  reply({200, {{"time_s", seconds(world_.time())}}, ""});
}

void ControlApi::get_clock(const ApiRequest& /*request*/, const Parts& /*parts*/,
                           const Reply& reply) {
  catch_up();
  reply({200, clock_json(), ""});
}

void ControlApi::put_clock(const ApiRequest& request, const Parts& /*parts*/, const Reply& reply) {
  const toml::table table = to_table(body_of(request));
  TableReader reader(table, "request", "");
  const ClockMode mode = read_clock(reader, "mode");
  reader.finish();
  check_clock_is_free(world_);
  world_.set_clock(mode);
  reply({200, clock_json(), ""});
}

void ControlApi::post_advance(const ApiRequest& request, const Parts& /*parts*/,
                              const Reply& reply) {
  const toml::table table = to_table(body_of(request));
  TableReader reader(table, "request", "");
  const auto by = read_duration(reader, "by_s");
  const auto to = read_duration(reader, "to_s");
  if (by && to) reader.fail("to_s", "give either by_s or to_s");
  if (!by && !to) reader.note_missing("by_s");
  reader.finish();
  check_clock_is_free(world_);
  if (!world_.clock().mode().stepped) {
    throw ApiError(409, "clock",
                   "time goes by itself (" + to_string(world_.clock().mode()) +
                       "); it is moved by hand when the clock is stepped");
  }
  if (world_.advancing()) throw ApiError(409, "clock", "time is being moved already");
  const SimTime now = world_.clock().stepped_time();
  const SimTime target = std::chrono::round<std::chrono::microseconds>(by ? now + *by : *to);
  if (target < now) reader.fail("to_s", "is past; it is " + std::to_string(seconds(now)) + " s");
  world_.advance(target, [this, reply](World::Advanced how) {
    const Json time_s = seconds(world_.time());
    switch (how) {
      case World::Advanced::kReached:
        return reply({200, {{"time_s", time_s}}, ""});
      case World::Advanced::kCancelled:
        return reply(error_response(409, "clock", "cancelled at " + time_s.dump() + " s"));
      case World::Advanced::kStuck:
        return reply(error_response(503, "clock",
                                    "replies do not leave: the disk or an interface does not take "
                                    "them; it is " +
                                        time_s.dump() + " s"));
    }
  });
}

void ControlApi::delete_advance(const ApiRequest& /*request*/, const Parts& /*parts*/,
                                const Reply& reply) {
  world_.cancel_advance();
  reply({200, {{"time_s", seconds(world_.time())}}, ""});
}

namespace {

ApiResponse absent(const char* what) {
  return error_response(501, what, std::string("this lk-emu has no ") + what);
}

}  // namespace

// The handlers of the table are of one type, so none is const.
// NOLINTBEGIN(readability-make-member-function-const)
void ControlApi::post_recording(const ApiRequest& request, const Parts& /*parts*/,
                                const Reply& reply) {
  if (!recording.start) return reply(absent("recording"));
  check_may_record(request);
  reply({200, recording.start(body_of(request), request.same_user), ""});
}

void ControlApi::delete_recording(const ApiRequest& /*request*/, const Parts& /*parts*/,
                                  const Reply& reply) {
  if (!recording.stop) return reply(absent("recording"));
  reply({200, recording.stop(), ""});
}

void ControlApi::post_scenario(const ApiRequest& request, const Parts& /*parts*/,
                               const Reply& reply) {
  if (!scenario.start) return reply(absent("scenario"));
  reply({200, scenario.start(body_of(request), request.same_user), ""});
}

void ControlApi::get_scenario(const ApiRequest& /*request*/, const Parts& /*parts*/,
                              const Reply& reply) {
  if (!scenario.report) return reply(absent("scenario"));
  catch_up();
  reply({200, scenario.report(), ""});
}

void ControlApi::delete_scenario(const ApiRequest& /*request*/, const Parts& /*parts*/,
                                 const Reply& reply) {
  if (!scenario.stop) return reply(absent("scenario"));
  reply({200, scenario.stop(), ""});
}
// NOLINTEND(readability-make-member-function-const)

void ControlApi::get_scenarios(const ApiRequest& /*request*/, const Parts& /*parts*/,
                               const Reply& reply) {
  catch_up();
  reply({200, scenarios_json(), ""});
}

}  // namespace lk::emulator
