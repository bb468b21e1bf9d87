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
  std::function<Json(const Json& request, bool same_user)> start;
  std::function<Json()> stop;    // for DELETE
  std::function<Json()> state;   // in /status; null when there is none
  std::function<Json()> report;  // for GET
};

/// Maps requests to actions. Uses no sockets.
class ControlApi {
 public:
  explicit ControlApi(World& world) : world_(world) {}

  Activity recording;
  Activity scenario;

  using Reply = std::function<void(ApiResponse)>;
  /// Calls `reply` once: at once, or for an advance when it ends. Does not throw.
  void handle(const ApiRequest& request, const Reply& reply);
  /// Cancels the advance of a client that has gone.
  void abandon() { world_.cancel_advance(); }
  const World& world() const { return world_; }

  /// Reads the parameters of a telemetry stream. Throws ApiError.
  TelemetryRequest read_telemetry_request(const ApiRequest& request);

  /// Returns the bus of a frame stream. Throws ApiError.
  Line& read_frames_request(const ApiRequest& request);

  /// Throws ApiError if there is no body.
  void read_body_request(const ApiRequest& request) const;

  struct Route {
    std::string_view method;
    std::string_view path;  // below kBasePath; {bus} and {id} stand for one part each
    void (ControlApi::*handle)(const ApiRequest&, const std::vector<std::string>& parts,
                               const Reply&);
  };
  static std::span<const Route> routes();
  static constexpr std::string_view kBasePath = "/api/v1";
  static constexpr std::string_view kTelemetryPath = "/api/v1/telemetry";
  static constexpr std::string_view kFramesPath = "/api/v1/frames";
  static constexpr std::string_view kBodyPath = "/api/v1/body";

 private:
  using Parts = std::vector<std::string>;
  void get_status(const ApiRequest&, const Parts&, const Reply& reply);
  void get_drives(const ApiRequest&, const Parts&, const Reply& reply);
  void get_drive(const ApiRequest&, const Parts& parts, const Reply& reply);
  void post_directives(const ApiRequest& request, const Parts&, const Reply& reply);
  void delete_directives(const ApiRequest&, const Parts&, const Reply& reply);
  void get_advice(const ApiRequest&, const Parts&, const Reply& reply);
  void get_faults(const ApiRequest&, const Parts&, const Reply& reply);
  void get_fault_kinds(const ApiRequest&, const Parts&, const Reply& reply);
  void get_signals(const ApiRequest&, const Parts&, const Reply& reply);
  void get_clock(const ApiRequest&, const Parts&, const Reply& reply);
  void put_clock(const ApiRequest& request, const Parts&, const Reply& reply);
  void post_advance(const ApiRequest& request, const Parts&, const Reply& reply);
  void delete_advance(const ApiRequest&, const Parts&, const Reply& reply);
  void post_recording(const ApiRequest& request, const Parts&, const Reply& reply);
  void delete_recording(const ApiRequest&, const Parts&, const Reply& reply);
  void post_scenario(const ApiRequest& request, const Parts&, const Reply& reply);
  void get_scenario(const ApiRequest&, const Parts&, const Reply& reply);
  void delete_scenario(const ApiRequest&, const Parts&, const Reply& reply);
  void get_scenarios(const ApiRequest&, const Parts&, const Reply& reply);
  void get_frames(const ApiRequest&, const Parts&, const Reply& reply);
  void post_frames(const ApiRequest&, const Parts&, const Reply& reply);
  void get_telemetry(const ApiRequest&, const Parts&, const Reply& reply);
  void get_body(const ApiRequest&, const Parts&, const Reply& reply);

  Json clock_json() const;
  /// Returns the named bus; null: the only one.
  Line& line_of(const std::string* bus);
  /// Returns the bus that a request names, and removes the name from `body`.
  Line& take_bus(Json& body);
  /// Processes frames that have arrived, so that the answer is current.
  void catch_up() { world_.serve_all(); }

  World& world_;
};

}  // namespace lk::emulator
