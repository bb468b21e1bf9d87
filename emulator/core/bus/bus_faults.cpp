// Faults of a bus: beginning, end, effects and evidence.

#include <cstddef>
#include <set>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/faults/acts.hpp"

namespace lk::emulator {

void Bus::begin_fault(std::size_t fault) {
  // It may have been cleared at this instant, or dropped from the board.
  if (!faults_.start(fault, time_)) return;
  LiveFault& live = faults_[fault];
  const FaultRow& row = live.row();
  if (live.will_recur()) agenda_.schedule(time_ + *live.fault.every, FaultBegin{fault});
  if (row.momentary()) {
    for (const int id : live.fault.ids) {
      Node& node = nodes_.of(id);
      AtOnce on{live, node.servo, lane(node), node.memory, node.power.alive, rom_writes_};
      const bool changed = row.at_once(on);
      if (changed) nodes_.update_addresses();
      if (on.restart) power_cycle(id);
      if (changed) live.took_effect(time_, id);
    }
    return;
  }
  if (row.adapter != nullptr) adapter_.set(faults_.adapter_times(own_adapter_));
  if (row.line_hold_time != nullptr) update_line_hold();
  if (live.fault.duration) agenda_.schedule(time_ + *live.fault.duration, FaultEnd{fault});
  for (std::size_t n = 0; n < live.fault.ids.size(); ++n) {
    live.anchors[n] = truth(live.fault.ids[n]).theta_out;
    apply_faults(nodes_.of(live.fault.ids[n]));
  }
  for (const int id : live.fault.ids) {
    const Node& node = nodes_.of(id);
    if (row.babble != nullptr) agenda_.schedule(time_, Babbling{fault, id});
    if (row.duplicate != nullptr) {
      duplicates_.add(faults_, fault, node.servo, motors_.f_pwm_Hz(node.motor), time_);
    }
  }
  agenda_.sample_by(time_ + kSamplePeriod);
}

void Bus::end_fault(std::size_t fault) {
  if (faults_.mark_sampled(fault, time_)) sample_fault(faults_[fault]);
  sample_faults();
  faults_.stop(fault);
  agenda_.cancel_fault<Babbling>(fault);
  stats_.replies_lost += duplicates_.remove(fault, wire_, time_);
  if (faults_[fault].row().adapter != nullptr) adapter_.set(faults_.adapter_times(own_adapter_));
  if (faults_[fault].row().line_hold_time != nullptr) update_line_hold();
  for (const int id : faults_[fault].fault.ids) apply_faults(nodes_.of(id));
}

void Bus::update_line_hold() {
  if (wire_.serial() == nullptr) return;
  const LiveFault* const holder = faults_.line_holder();
  wire_.serial()->hold_line(holder != nullptr ? holder->row().line_hold_time(*holder) : SimTime{0});
}

void Bus::apply_faults(Node& node) {
  node.servo.faults = faults_.firmware_faults(node.id());
  LiveFault* const blocking = faults_.first(node.id(), &FaultRow::blocks);
  if (blocking == nullptr && node.link.blocked) {
    node.link.release(wire_, time_);
  } else if (blocking != nullptr && !node.link.blocked) {
    const std::size_t caught = node.link.block(wire_, time_);
    for (std::size_t n = 0; n < caught; ++n) blocking->took_effect(time_, node.id());
  }
  if (faults_.first(node.id(), &FaultRow::holds_back) == nullptr) {
    stats_.replies_lost += node.link.release_held_back(wire_, time_);
  }
  const Lane motor = lane(node);
  const model::Faults plant = faults_.plant_faults(node.servo.config, time_);
  if (!(motor.bank.faults(motor.index) == plant)) motor.bank.set_faults(motor.index, plant);
}

/// Samples lasting faults of the plant: counts visible effects, updates faults that move.
void Bus::sample_faults() {
  std::set<int> varying;
  for (const std::size_t fault : faults_.take_due_samples(time_)) {
    LiveFault& live = faults_[fault];
    sample_fault(live);
    if (live.row().varies_in_time) varying.insert(live.fault.ids.begin(), live.fault.ids.end());
  }
  for (const int id : varying) apply_faults(nodes_.of(id));
}

void Bus::sample_fault(LiveFault& live) {
  for (const int id : live.fault.ids) {
    const Node& node = nodes_.of(id);
    const model::Faults alone = plant_faults(live, node.servo.config, time_);
    const std::size_t motor = motors_.index(node.motor);
    if (motors_.bank(node.motor).takes_effect(motor, alone)) live.took_effect(time_, id);
  }
}

bool Bus::is_disturbed() {
  if (flags_left_ == 0 || wire_.can() == nullptr || wire_.bitrate() == 0) return false;
  for (Node& node : nodes_) {
    if (node.flags_left == 0 || !node.power.alive) continue;
    --node.flags_left;
    --flags_left_;
    return true;
  }
  return false;
}

bool Bus::destroy_next() {
  const bool disturbed = is_disturbed();
  if (!disturbed && !faults_.any_active()) return false;
  if (wire_.serial() != nullptr && !wire_.serial()->take_fault_chance()) return false;
  const WireCandidate next = wire_.next();
  const int id = static_cast<int>(next.owner & 0x3FU);
  const bool of_drive = !next.from_host && next.owner < Duplicates::kFirstOwner;
  LiveFault* const fault = disturbed ? nullptr
                                     : faults_.destroyer(of_drive ? id : kWholeBus, wire_.bitrate(),
                                                         serial_.has_value());
  if (!disturbed && fault == nullptr) return false;
  if (fault != nullptr) {
    fault->took_effect(time_, fault->row().of_bus ? kWholeBus : id, &next.frame);
  }
  if (wire_.serial() != nullptr) {  // not detected, so not sent again
    wire_.serial()->spoil_next();
    return false;
  }
  had_errors_ = true;
  int& errors = transmit_errors(next);
  to_host({time_, report_error(host_errors_, next.from_host)});
  if (!next.from_host) errors += kErrorStep;
  if (errors >= kBusOff) {
    errors = 0;
    wire_.can()->destroy_for_good(CanWire::kRecoveryBits);
    leave_bus(next);
  } else {
    wire_.can()->destroy(errors >= kErrorPassive ? CanWire::kSuspendBits : 0);
  }
  return true;
}

int& Bus::transmit_errors(const WireCandidate& frame) {
  if (frame.from_host) return host_errors_.transmit_errors;
  if (frame.owner >= Duplicates::kFirstOwner) return duplicates_.errors(frame.owner);
  return nodes_.of(static_cast<int>(frame.owner & 0x3FU)).link.errors;
}

/// The controllers of hosts and of duplicates recover by themselves.
void Bus::leave_bus(const WireCandidate& given_up) {
  if (given_up.from_host) {
    stats_.drop(Drop::kFault);
    return;
  }
  ++stats_.replies_lost;
  if (given_up.owner >= Duplicates::kFirstOwner) return;
  Node& node = nodes_.of(static_cast<int>(given_up.owner & 0x3FU));
  stats_.replies_lost += node.link.drop_all(wire_, time_);
  const SimTime recovery = wire_.bits(CanWire::kRecoveryBits) + faults_.recovery(node.id());
  if (recovery > SimTime{0}) {
    node.link.bus_off = true;
    agenda_.schedule(time_ + recovery, BusOffEnd{node.id()});
  }
}

}  // namespace lk::emulator
