#include "emulator/control/control_send.hpp"

#include "emulator/config/scenario/config_send.hpp"
#include "emulator/control/control_api.hpp"
#include "emulator/control/control_json.hpp"
#include "emulator/core/frame_text.hpp"
#include "emulator/core/wire/can_wire.hpp"

namespace lk::emulator {

Json send_frames(const Json& said, Line& line) {
  const toml::table table = to_table(said);
  TableReader reader(table, "request", "");
  const auto frames = read_frames(reader, line.config());
  reader.finish();
  const Bus& bus = line.bus();
  if (bus.stats().frames_waiting + frames.size() > CanWire::kHostQueue || bus.host_queue_full() ||
      line.backlog() > 0) {
    throw ApiError(409, "frame", "too many frames wait for the wire, or for the clock to move");
  }
  Json texts = Json::array();
  for (const protocol::Frame& frame : frames) {
    line.take_in({bus.time(), frame});
    texts.push_back(frame_text(frame));
  }
  return {{"time_s", seconds(bus.time())}, {"frames", texts}};
}

}  // namespace lk::emulator
