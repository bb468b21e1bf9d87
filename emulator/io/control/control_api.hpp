#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/core/telemetry.hpp"
#include "emulator/files/json_table.hpp"
#include "emulator/io/live/world.hpp"

namespace lk::emulator {

/// A request to the control interface, over a Unix socket or TCP.
struct ApiRequest {
  std::string method;                        // "GET"
  std::string path;                          // "/api/v1/status"
  std::map<std::string, std::string> query;  // decoded
  std::string content_type;
  std::string body;
  bool from_page = false;        // sent by a browser page
  bool pages_may_write = false;  // of its endpoint (Access): all its clients may write
  bool same_user = true;         // only this user can connect to its endpoint
  bool has_token = false;        // the client has shown the required token
  bool is_public = false;        // no token is required: --http-token none
};

struct ApiResponse {
  int status = 200;
  Json body;
  std::string allow;  // value of the header Allow; only with status 405
};

/// Thrown by handlers; becomes an error response. `where`: key or part of the request at fault.
struct ApiError : std::runtime_error {
  ApiError(int code, std::string at, const std::string& why)
      : std::runtime_error(why), status(code), where(std::move(at)) {}
  int status;
  std::string where;
};
ApiResponse error_response(int status, const std::string& where, const std::string& reason);

/// A recording or a scenario that clients start and stop. An empty function is answered with 501.
/// Functions throw ApiError, or ConfigError if the request is invalid.
struct Activity {
  /// For POST; returns the response's body. Unless `same_user`, the client must not learn which
  /// files exist.
  std::function<Json(TableReader& request, bool same_user)> start;
  std::function<Json()> stop;    // for DELETE
  std::function<Json()> state;   // for /status; null: no recording runs, or no scenario yet
  std::function<Json()> report;  // for GET
};

using ApiReply = std::function<void(ApiResponse)>;
struct ApiCall;

struct ApiRoute {
  std::string_view method;
  std::string_view path;  // below ControlApi::kBasePath; {bus} and {id} match any one part
  void (*handle)(const ApiCall& call);
};

/// Maps requests to actions. Uses no sockets.
class ControlApi {
 public:
  explicit ControlApi(World& world) : world_(world) {}

  Activity recording;
  Activity scenario;

  /// Calls `reply` once: at once, or for an advance when it ends. Does not throw.
  void handle(const ApiRequest& request, const ApiReply& reply);
  /// Cancels the present advance, whose client has disconnected.
  void abandon() { world_.end_advance(); }
  World& world() { return world_; }

  static std::span<const ApiRoute> routes();
  static constexpr std::string_view kBasePath = "/api/v1";
  static constexpr std::string_view kTelemetryPath = "/api/v1/telemetry";
  static constexpr std::string_view kFramesPath = "/api/v1/frames";
  static constexpr std::string_view kBodyPath = "/api/v1/body";

 private:
  World& world_;
};

/// Arguments of a route's handler.
struct ApiCall {
  ControlApi& api;
  World& world;
  const ApiRequest& request;
  const std::vector<std::string>& parts;  // of the path, that match {bus} and {id}, in order
  const ApiReply& reply;
  TableReader& body;  // empty for methods without a body
};

/// Limit for a bus: clients can plan no directive that would exceed it.
inline constexpr std::size_t kMaxPlanned = 1000;

/// Executes {"clear": `which`} on `line`, and notifies listeners. Pre: `which` is a fault on it,
/// "all" or "planned".
void request_clear(Line& line, const std::string& which);

/// Returns the line named `bus`; null: the only line. Throws ApiError if the name is unknown, or
/// needed because there are several lines.
Line& line_of(World& world, const std::string* bus);

// Check the query of a request for a stream; throw ApiError.
TelemetryRequest read_telemetry_request(World& world, const ApiRequest& request);
/// Returns the line whose frames the client wants.
Line& read_frames_request(World& world, const ApiRequest& request);
/// Also throws if the robot has no body that can be drawn.
void check_body_request(const World& world, const ApiRequest& request);

// Handlers of GET on the paths of streams, for requests without an upgrade to WebSocket.
void get_telemetry(const ApiCall& call);
void get_frames(const ApiCall& call);
void get_body(const ApiCall& call);

}  // namespace lk::emulator
