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
#include "emulator/live/world.hpp"

namespace lk::emulator {

/// A request, whatever it came by.
struct ApiRequest {
  std::string method;                        // "GET"
  std::string path;                          // "/api/v1/status"
  std::map<std::string, std::string> query;  // decoded
  std::string content_type;
  std::string body;
  bool from_page = false;        // a browser sent it, for a page
  bool pages_may_write = false;  // where it came in
  bool same_user = true;         // nobody else gets in there
  bool showed_token = false;     // whoever sent it has shown what was asked for
  bool from_anybody = false;     // nothing was asked for, by --http-token none
};

struct ApiResponse {
  int status = 200;
  Json body;
  std::string allow;  // of 405
};

/// An answer that is no success.
struct ApiError : std::runtime_error {
  ApiError(int code, std::string at, const std::string& why)
      : std::runtime_error(why), status(code), where(std::move(at)) {}
  int status;
  std::string where;
};
ApiResponse error_response(int status, const std::string& where, const std::string& reason);

/// What can be started and stopped, and by whom. Functions may be absent: the answer is 501 then.
/// They throw ApiError, or ConfigError for what is wrong with what the request says.
struct Activity {
  /// Of POST; returns the answer. What files there are is for nobody but the `same_user`.
  std::function<Json(const Json& request, bool same_user)> start;
  std::function<Json()> stop;    // of DELETE
  std::function<Json()> state;   // in /status; null when there is none
  std::function<Json()> report;  // of GET
};

/// Which request does what. Pure: knows no socket.
class ControlApi {
 public:
  explicit ControlApi(World& world) : world_(world) {}

  Activity recording;
  Activity scenario;

  using Reply = std::function<void(ApiResponse)>;
  /// Calls `reply` once: at once, or, for an advance, when it is done. Throws nothing.
  void handle(const ApiRequest& request, const Reply& reply);
  /// Whoever asked has gone: what only they wanted ends.
  void abandon() { world_.cancel_advance(); }
  const World& world() const { return world_; }

  /// What a telemetry stream is asked to tell. Throws ApiError.
  TelemetryRequest read_telemetry_request(const ApiRequest& request);

  /// The bus whose frames are asked for. Throws ApiError.
  Line& read_frames_request(const ApiRequest& request);

  /// Throws ApiError where there is no body to tell of.
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
  /// The bus that is meant: the only one, unless it is named.
  Line& line_of(const std::string* bus);
  /// The bus that a request names, which is taken out of it.
  Line& line_said(Json& said);
  /// What is on the buses now, not a millisecond ago.
  void catch_up() { world_.serve_all(); }

  World& world_;
};

}  // namespace lk::emulator
