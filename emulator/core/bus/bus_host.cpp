// The hosts' side of a CAN bus: acknowledgement, send queue, and faults that cut the connection.

#include <algorithm>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/faults/acts.hpp"
#include "protocol/command_info.hpp"

namespace lk::emulator {
namespace {

/// Age from which a command counts as stale. Hosts send faster than 10 Hz; assumed.
constexpr SimTime kStale = std::chrono::milliseconds(100);

void count_cut(BusState& bus, const protocol::Frame* frame = nullptr) {
  each_active(bus.faults, &FaultRow::cut, kWholeBus, [&](LiveFault& live) {
    if (live.row().cut(live) == bus.host.cut) live.took_effect(bus.time, kWholeBus, frame);
  });
}

/// Returns true for a motion command, and for 0x88, which may resume one.
bool moves(const protocol::Frame& frame) {
  if (protocol::find_multi_drive(frame.id) != nullptr) return true;
  const protocol::Opcode opcode{frame.data[0]};
  return opcode == protocol::Run::kOpcode ||
         (opcode >= protocol::OpenLoop::kOpcode && opcode <= protocol::Position6::kOpcode);
}

bool acknowledges(BusState& bus, const Node& node) {
  return node.power.alive && !node.link.bus_off && node.servo.on_its_bus() &&
         node.servo.at_its_rate() && bus.faults.first(node.id(), &FaultRow::off_the_bus) == nullptr;
}

}  // namespace

bool queue_from_host(BusState& bus, SimTime ready, const TimedFrame& in) {
  if (bus.host.is_off()) {
    bus.own_stats.drop(Reject::kFault);
    count_cut(bus, &in.frame);
    return true;
  }
  const std::size_t depth = bus.adapter.tx_depth();
  const bool overrun =
      bus.wire.can() != nullptr && depth > 0 && bus.wire.host_queue_size() >= depth;
  if (overrun) count_adapter(bus.faults, {.lost = true}, in.frame, bus.time);
  if (overrun || bus.wire.host_queue_full()) {
    bus.own_stats.drop(Reject::kQueueFull);
    const bool room = bus.host.full == QueueFull::kDropOldest && bus.wire.can() != nullptr &&
                      bus.wire.can()->drop_oldest_from_host(bus.time);
    if (!room) return bus.host.full != QueueFull::kRefuse;
  }
  bus.wire([&](auto& wire) { wire.send_from_host(ready, in.frame, in.sender); });
  bus.own_stats.queue_peak =
      std::max<std::uint64_t>(bus.own_stats.queue_peak, bus.wire.host_queue_size());
  return true;
}

bool has_receiver(BusState& bus) {
  if (bus.host.cut == HostCut::kCable) return false;
  if (bus.host.always_acknowledged || !bus.duplicates.empty()) return true;
  return std::ranges::any_of(bus.nodes, [&](const Node& node) { return acknowledges(bus, node); });
}

void repeat_unacknowledged(BusState& bus, const protocol::Frame& frame) {
  const bool first = !std::exchange(bus.host.unacknowledged, true);
  bus.had_errors = true;
  if (first) {
    ++bus.own_stats.unacknowledged;
    count_cut(bus, &frame);
  }
  if (const auto report = report_no_ack(bus.host.errors, first)) to_host(bus, {bus.time, *report});
  const bool passive = bus.host.errors.transmit_errors >= kErrorPassive;
  bus.wire.can()->destroy(passive ? CanWire::kSuspendBits : 0, CanWire::kNoAckBits);
}

void count_sent(BusState& bus, const WireDelivery& sent) {
  if (std::exchange(bus.host.unacknowledged, false)) {
    bus.host.to_replay = bus.wire.host_queue_size() + 1;
    bus.host.stale = {};
  }
  --bus.host.to_replay;
  ++bus.own_stats.replayed;
  const SimTime age = sent.at - sent.queued_at;
  if (age <= kStale) return;
  ++bus.own_stats.stale;
  StaleCommands& stale = bus.host.stale;
  if (!moves(sent.frame)) return;
  if (stale.count++ == 0) stale.frame = sent.frame;
  stale.age = std::max(stale.age, age);
}

bool is_cut_off(BusState& bus, const TimedFrame& frame) {
  if (bus.host.cut == HostCut::kNone || frame.frame.kind == protocol::FrameKind::kError) {
    return false;
  }
  count_cut(bus, &frame.frame);
  if (frame.sender == 0) ++bus.own_stats.replies_lost;
  return true;
}

void set_host_cut(BusState& bus, HostCut cut) {
  CanWire* const wire = bus.wire.can();
  if (wire == nullptr || cut == bus.host.cut) return;
  const bool was_bus_off = bus.host.cut == HostCut::kOff;
  bus.host.cut = cut;
  if (bus.host.is_off()) {
    const std::size_t lost = wire->drop_from_hosts(bus.time);
    for (std::size_t n = 0; n < lost; ++n) {
      bus.own_stats.drop(Reject::kFault);
      count_cut(bus);
    }
    bus.host.errors = {};
    bus.host.unacknowledged = false;
    bus.host.to_replay = 0;
  }
  // Hosts that have used the adapter see at once that it is gone.
  if (cut >= HostCut::kGone && bus.own_stats.frames > 0) count_cut(bus);
  if (cut == HostCut::kOff) to_host(bus, {bus.time, report_bus_off(false)});
  if (cut == HostCut::kNone && was_bus_off) to_host(bus, {bus.time, report_bus_off(true)});
}

}  // namespace lk::emulator
