// Of the control interface: what comes again and again, over WebSockets.

#include "emulator/control/control_api.hpp"

namespace lk::emulator {

/// Whoever may listen to a stream asks for an upgrade, and does not come here.
void ControlApi::get_telemetry(const ApiRequest& request, const Parts& /*parts*/,
                               const Reply& reply) {
  read_telemetry_request(request);
  reply(error_response(426, "Upgrade", "telemetry comes over a WebSocket"));
}

void ControlApi::get_frames(const ApiRequest& request, const Parts& /*parts*/, const Reply& reply) {
  read_frames_request(request);
  reply(error_response(426, "Upgrade", "frames come over a WebSocket"));
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
