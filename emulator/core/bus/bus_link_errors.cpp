// Frames that do not get through: error frames, error counters and bus-off.

#include <algorithm>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/wire_timing.hpp"

namespace lk::emulator {
namespace {

int id_of(std::uint32_t owner) { return static_cast<int>(owner & 0x3FU); }

bool is_double(std::uint32_t owner) { return owner >= duplicate_owner(0, 0); }

}  // namespace

/// The fault that destroys this frame; null when it gets through.
LiveFault* Bus::destroyer(const CanWire::Candidate& next) {
  LiveFault* found = nullptr;
  for (LiveFault& live : faults_) {
    if (!live.active() || found != nullptr) {
      continue;
    }
    const bool own = !next.from_host && !is_double(next.owner) && live.is_of(id_of(next.owner));
    if ((live.fault.kind == FaultKind::kErrorFrames && live.hits()) ||
        (live.fault.kind == FaultKind::kBusOff && own)) {
      found = &live;
    }
  }
  return found;
}

/// The counter of whoever sends this.
int& Bus::transmit_errors(const CanWire::Candidate& next) {
  if (next.from_host) {
    return host_link_.transmit_errors;
  }
  if (is_double(next.owner)) {
    return std::ranges::find(duplicates_, next.owner, &DuplicateDrive::owner)->errors;
  }
  return nodes_[index_of(id_of(next.owner))].link.errors;
}

/// A fault destroys the frame whose last bit is due. Returns false when none does.
bool Bus::destroy_next() {
  if (active_faults_ == 0) {
    return false;
  }
  const CanWire::Candidate next = wire_.next();
  LiveFault* const fault = destroyer(next);
  if (fault == nullptr) {
    return false;
  }
  const bool of_bus = fault->fault.ids.empty();
  took_effect(*fault, of_bus ? kWholeBus : id_of(next.owner), &next.frame);
  had_errors_ = true;
  ++stats_.error_frames;
  int& errors = transmit_errors(next);
  replies_.push_back({time_, report_error(host_link_, next.from_host)});
  if (!next.from_host) {
    errors += kErrorStep;
  }
  if (errors >= kBusOff) {
    errors = 0;
    wire_.spoil_for_good(CanWire::kRecoveryBits);
    leave_bus(next);
  } else {
    wire_.spoil(errors >= kErrorPassive ? CanWire::kSuspendBits : 0);
  }
  return true;
}

/// The controller that wanted to send this has given it up. That of the hosts, and that of a second
/// drive, start anew by themselves.
void Bus::leave_bus(const CanWire::Candidate& given_up) {
  if (given_up.from_host) {
    drop(Drop::kFault);
    return;
  }
  ++stats_.replies_lost;
  if (is_double(given_up.owner)) {
    return;
  }
  const std::size_t k = index_of(id_of(given_up.owner));
  forget_words(k, time_);
  SimTime recovery = bitrate_ > 0 ? bits_duration(CanWire::kRecoveryBits, bitrate_) : SimTime{0};
  if (const LiveFault* const fault = active_fault(k, FaultKind::kBusOff)) {
    recovery += from_ms(fault->value(0));
  }
  if (recovery > SimTime{0}) {
    nodes_[k].link.bus_off = true;
    agenda_.enter(time_ + recovery, BusOffEnd{k});
  }
}

/// Somebody's frame got through; everybody's counters go down again.
void Bus::count_success(const CanWire::Delivery& delivery) {
  const CanWire::Candidate sent{delivery.frame, delivery.from_host, delivery.owner};
  emulator::count_success(host_link_, delivery.from_host);
  if (!delivery.from_host) {
    int& errors = transmit_errors(sent);
    errors = std::max(errors - 1, 0);
  }
}

}  // namespace lk::emulator
