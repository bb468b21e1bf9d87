#include "emulator/core/bus/wire.hpp"

#include "emulator/core/seed.hpp"
#include "emulator/core/wire_timing.hpp"

namespace lk::emulator {
namespace {

std::variant<CanWire, SerialWire> medium_of(const BusConfig& config) {
  if (!config.serial) return CanWire(config.bitrate, config.host_queue.frames);
  const SerialConfig& serial = *config.serial;
  protocol::ReceiverRules rules{.max_len = serial.max_len, .scan = serial.scan, .gap = serial.gap};
  if (config.bitrate > 0) {
    rules.broadcast_gap = bits_duration(serial.broadcast_gap_bits, config.bitrate);
  }
  return SerialWire(config.bitrate, rules, stream_seed(config.seed, 0, SeedStream::kWire),
                    serial.receives_while_replying);
}

}  // namespace

Wire::Wire(const BusConfig& config) : medium_(medium_of(config)) {}

}  // namespace lk::emulator
