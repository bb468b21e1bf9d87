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

/// A request over any transport.
struct ApiRequest {
  std::string method;                        // "GET"
  std::string path;                          // "/api/v1/status"
  std::map<std::string, std::string> query;  // decoded
  std::string content_type;
  std::string body;
  bool from_page = false;        // sent by a browser page
  bool pages_may_write = false;  // setting of its entrance
  bool same_user = true;         // only this user can connect there
  bool has_token = false;        // the client has shown the required token
  bool is_public = false;        // no token is required: --http-token none
};

struct ApiResponse {
  int status = 200;
  Json body;
  std::string allow;  // of 405
};

/// Answer to a request that fails.
struct ApiError : std::runtime_error {
  ApiError(int code, std::string at, const std::string& why)
      : std::runtime_error(why), status(code), where(std::move(at)) {}
  int status;
  std::string where;
};
ApiResponse error_response(int status, const std::string& where, const std::string& reason);

/// Something that requests start and stop. A missing function gives the answer 501. Functions throw
/// ApiError, or ConfigError if the request is wrong.
struct Activity {
  /// For POST; returns the answer. Only the `same_user` may learn which files exist.
  std::function<Json(TableReader& request, bool same_user)> start;
  std::function<Json()> stop;    // for DELETE
  std::function<Json()> state;   // in /status; null when there is none
  std::function<Json()> report;  // for GET
};

using ApiReply = std::function<void(ApiResponse)>;
struct ApiCall;

struct ApiRoute {
  std::string_view method;
  std::string_view path;  // below ControlApi::kBasePath; {bus} and {id} stand for one part each
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
  /// Cancels the advance of a client that has gone.
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

/// A request on its way to the handler of its route.
struct ApiCall {
  ControlApi& api;
  World& world;
  const ApiRequest& request;
  const std::vector<std::string>& parts;  // of the path, in place of {bus} and {id}
  const ApiReply& reply;
  TableReader& body;  // empty if the method has none
};

/// Limit for directives that clients have planned on a bus.
inline constexpr std::size_t kMaxPlanned = 1000;

/// Clears as a client's directive `clear` does. Pre: `which` is valid.
void request_clear(Line& line, const std::string& which);

/// Returns the named bus; null: the only one. Throws ApiError.
Line& line_of(World& world, const std::string* bus);

// Parameters of streams. These throw ApiError.
TelemetryRequest read_telemetry_request(World& world, const ApiRequest& request);
/// Returns the bus of a frame stream.
Line& read_frames_request(World& world, const ApiRequest& request);
/// Requires a robot with a body.
void check_body_request(const World& world, const ApiRequest& request);

// Handlers of requests for a stream without an upgrade.
void get_telemetry(const ApiCall& call);
void get_frames(const ApiCall& call);
void get_body(const ApiCall& call);

}  // namespace lk::emulator
