// Faults of a bus: beginning, end, effects and evidence.

#include <cstddef>
#include <set>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/faults/acts.hpp"

namespace lk::emulator {

namespace {

/// Updates the hosts' adapter, and how long hosts hold the RS-485 line, for the active faults.
void apply_host_faults(BusState& bus) {
  bus.adapter.set(adapter_times(bus.faults, bus.own_adapter));
  set_host_cut(bus, host_cut(bus.faults));
  SerialWire* const wire = bus.wire.serial();
  if (wire == nullptr) return;
  const LiveFault* const holder = line_holder(bus.faults);
  wire->hold_line(holder != nullptr ? holder->row().line_hold_time(*holder) : SimTime{0});
}

/// Updates motor, link and firmware of a drive for its active faults.
void apply_faults(BusState& bus, Node& node) {
  node.servo.faults = firmware_faults(bus.faults, node.id());
  LiveFault* const blocking = bus.faults.first(node.id(), &FaultRow::blocks);
  if (blocking == nullptr && node.link.blocked) {
    node.link.release(bus.wire, bus.time);
  } else if (blocking != nullptr && !node.link.blocked) {
    const std::size_t caught = node.link.block(bus.wire, bus.time);
    for (std::size_t n = 0; n < caught; ++n) blocking->took_effect(bus.time, node.id());
  }
  if (bus.faults.first(node.id(), &FaultRow::holds_back) == nullptr) {
    bus.own_stats.replies_lost += node.link.release_held_back(bus.wire, bus.time);
  }
  const Lane motor = bus.lane(node);
  const model::Faults plant = plant_faults(bus.faults, node.servo.config, bus.time);
  if (!(motor.bank.inputs(motor.index).faults == plant)) motor.bank.set_faults(motor.index, plant);
}

void sample_fault(BusState& bus, LiveFault& live) {
  for (const int id : live.fault.ids) {
    const Node& node = bus.nodes.of(id);
    const model::Faults alone = plant_faults(live, node.servo.config, bus.time);
    const std::size_t motor = bus.motors.index(node.motor);
    if (bus.motors.bank(node.motor).takes_effect(motor, alone)) live.took_effect(bus.time, id);
  }
}

/// Returns true if a drive at another bit rate destroys the next frame with an error flag. Such a
/// drive flags each frame until it is error-passive.
bool is_disturbed(BusState& bus) {
  if (bus.flags_left == 0 || bus.wire.can() == nullptr || bus.wire.bitrate() == 0) return false;
  for (Node& node : bus.nodes) {
    if (node.flags_left == 0 || !node.power.alive) continue;
    --node.flags_left;
    --bus.flags_left;
    return true;
  }
  return false;
}

/// Call when the sender of a frame reaches bus-off and gives the frame up. Only a drive leaves the
/// bus here: the controllers of hosts and of duplicates recover by themselves.
void leave_bus(BusState& bus, const WireCandidate& given_up) {
  if (given_up.from_host) {
    bus.own_stats.drop(Reject::kFault);
    return;
  }
  ++bus.own_stats.replies_lost;
  if (given_up.owner >= Duplicates::kFirstOwner) return;
  Node& node = bus.nodes.of(static_cast<int>(given_up.owner & 0x3FU));
  bus.own_stats.replies_lost += node.link.drop_all(bus.wire, bus.time);
  const SimTime pause =
      bits_duration(CanWire::kRecoveryBits, bus.wire.bitrate()) + recovery(bus.faults, node.id());
  if (pause > SimTime{0}) {
    node.link.bus_off = true;
    bus.agenda.schedule(bus.time + pause, BusOffEnd{node.id()});
  }
}

}  // namespace

void begin_fault(BusState& bus, std::size_t fault) {
  // The fault may have been cleared at this instant, or dropped from the board.
  if (!bus.faults.start(fault, bus.time)) return;
  LiveFault& live = bus.faults[fault];
  const FaultRow& row = live.row();
  if (live.will_recur()) bus.agenda.schedule(bus.time + *live.fault.every, FaultBegin{fault});
  for (const int id : live.fault.ids) bus.nodes.of(id).unasked.on_event(AngleEvent::kFault);
  if (row.momentary()) {
    for (const int id : live.fault.ids) {
      Node& node = bus.nodes.of(id);
      AtOnce on{live, node.servo, bus.lane(node), node.memory, node.power.alive, bus.rom_writes};
      const bool changed = row.at_once(on);
      if (changed) bus.nodes.update_addresses();
      if (on.restart) power_cycle(bus, id);
      if (changed) live.took_effect(bus.time, id);
    }
    return;
  }
  apply_host_faults(bus);
  if (live.fault.duration) bus.agenda.schedule(bus.time + *live.fault.duration, FaultEnd{fault});
  for (std::size_t n = 0; n < live.fault.ids.size(); ++n) {
    live.anchors[n] = bus.truth(live.fault.ids[n]).theta_out;
    apply_faults(bus, bus.nodes.of(live.fault.ids[n]));
  }
  for (const int id : live.fault.ids) {
    const Node& node = bus.nodes.of(id);
    if (row.babble != nullptr) bus.agenda.schedule(bus.time, Babbling{fault, id});
    if (row.duplicate != nullptr) {
      bus.duplicates.add(bus.faults, fault, node.servo, bus.motors.f_pwm_Hz(node.motor), bus.time);
    }
  }
  bus.agenda.sample_by(bus.time + kSamplePeriod);
}

void end_fault(BusState& bus, std::size_t fault) {
  if (bus.faults.mark_sampled(fault, bus.time)) sample_fault(bus, bus.faults[fault]);
  sample_faults(bus);
  bus.faults.stop(fault);
  bus.agenda.cancel_fault<Babbling>(fault);
  bus.own_stats.replies_lost += bus.duplicates.remove(fault, bus.wire, bus.time);
  apply_host_faults(bus);
  for (const int id : bus.faults[fault].fault.ids) apply_faults(bus, bus.nodes.of(id));
}

/// Samples lasting plant faults: counts visible effects, and updates faults that vary in time.
void sample_faults(BusState& bus) {
  std::set<int> varying;
  for (const std::size_t fault : bus.faults.take_due_samples(bus.time)) {
    LiveFault& live = bus.faults[fault];
    sample_fault(bus, live);
    if (live.row().varies_in_time) varying.insert(live.fault.ids.begin(), live.fault.ids.end());
  }
  for (const int id : varying) apply_faults(bus, bus.nodes.of(id));
}

bool destroy_next(BusState& bus) {
  const bool disturbed = is_disturbed(bus);
  if (!disturbed && !bus.faults.any_active()) return false;
  if (bus.wire.serial() != nullptr && !bus.wire.serial()->take_fault_chance()) return false;
  const WireCandidate next = bus.wire.next();
  const int id = static_cast<int>(next.owner & 0x3FU);
  const bool of_drive = !next.from_host && next.owner < Duplicates::kFirstOwner;
  LiveFault* const fault = disturbed ? nullptr
                                     : destroyer(bus.faults, of_drive ? id : kWholeBus,
                                                 bus.wire.bitrate(), bus.serial.has_value());
  if (!disturbed && fault == nullptr) return false;
  if (fault != nullptr) {
    fault->took_effect(bus.time, fault->row().of_bus ? kWholeBus : id, &next.frame);
  }
  if (bus.wire.serial() != nullptr) {  // no sender detects it, so none sends the frame again
    bus.wire.serial()->spoil_next();
    return false;
  }
  bus.had_errors = true;
  int& errors = transmit_errors(bus, next);
  to_host(bus, {bus.time, report_error(bus.host.errors, next.from_host)});
  if (!next.from_host) errors += kErrorStep;
  if (errors >= kBusOff) {
    errors = 0;
    bus.wire.can()->destroy_for_good(CanWire::kRecoveryBits);
    leave_bus(bus, next);
  } else {
    bus.wire.can()->destroy(errors >= kErrorPassive ? CanWire::kSuspendBits : 0);
  }
  return true;
}

int& transmit_errors(BusState& bus, const WireCandidate& frame) {
  if (frame.from_host) return bus.host.errors.transmit_errors;
  if (frame.owner >= Duplicates::kFirstOwner) return bus.duplicates.errors(frame.owner);
  return bus.nodes.of(static_cast<int>(frame.owner & 0x3FU)).link.errors;
}

}  // namespace lk::emulator
