// WebSocket streams of the control interface.

#include "emulator/control/body_json.hpp"
#include "emulator/control/control_api.hpp"

namespace lk::emulator {

/// Reached only by requests without an upgrade.
void ControlApi::get_telemetry(const ApiRequest& request, const Parts& /*parts*/,
                               const Reply& reply) {
  read_telemetry_request(request);
  reply(error_response(426, "Upgrade", "telemetry comes over a WebSocket"));
}

void ControlApi::get_frames(const ApiRequest& request, const Parts& /*parts*/, const Reply& reply) {
  read_frames_request(request);
  reply(error_response(426, "Upgrade", "frames come over a WebSocket"));
}

/// Without an upgrade: returns the shape to which the stream's poses belong.
void ControlApi::get_body(const ApiRequest& request, const Parts& /*parts*/, const Reply& reply) {
  read_body_request(request);
  catch_up();
  reply({200, body_json(world_), ""});
}

void ControlApi::read_body_request(const ApiRequest& request) const {
  if (!request.query.empty()) {
    throw ApiError(400, request.query.begin()->first, "unknown; this request has no parameters");
  }
  if (looks_of(world_) == nullptr)
    throw ApiError(404, "body", "the drives turn the joints of no body");
}

Line& ControlApi::read_frames_request(const ApiRequest& request) {
  const std::string* bus = nullptr;
  for (const auto& [key, value] : request.query) {
    if (key != "bus") throw ApiError(400, key, "unknown; there is bus");
    bus = &value;
  }
  return line_of(bus);
}

}  // namespace lk::emulator
