#include "emulator/core/bus/can_errors.hpp"

#include <algorithm>

namespace lk::emulator {
namespace {

// linux/can/error.h: error classes, and values of data[1] to data[3].
constexpr std::uint32_t kClassController = 0x004;
constexpr std::uint32_t kClassProtocol = 0x008;
constexpr std::uint32_t kClassNoAck = 0x020;
constexpr std::uint32_t kClassBusOff = 0x040;
constexpr std::uint32_t kClassBusError = 0x080;
constexpr std::uint32_t kClassRestarted = 0x100;
constexpr std::uint32_t kClassCounters = 0x200;
constexpr std::uint8_t kReceiveOverflow = 0x01;
constexpr std::uint8_t kReceiveWarning = 0x04;
constexpr std::uint8_t kTransmitWarning = 0x08;
constexpr std::uint8_t kReceivePassive = 0x10;
constexpr std::uint8_t kTransmitPassive = 0x20;
constexpr std::uint8_t kOnTransmission = 0x80;
constexpr std::uint8_t kNoRecessiveBit = 0x10;
constexpr std::uint8_t kInCrc = 0x08;
constexpr std::uint8_t kInEndOfFrame = 0x1A;

constexpr int kMaxReceiveErrors = 255;
constexpr int kBackFromPassive = 119;  // ISO 11898-1: between 119 and 127

/// Returns `passive` or `warning` if the step from `before` to `now` reaches this state, else 0.
std::uint8_t reached(int before, int now, std::uint8_t warning, std::uint8_t passive) {
  const auto passes = [&](int level) { return before < level && now >= level; };
  return passes(kErrorPassive) ? passive : passes(kErrorWarning) ? warning : std::uint8_t{0};
}

protocol::Frame error_frame(std::uint32_t classes) {
  protocol::Frame frame;
  frame.kind = protocol::FrameKind::kError;
  frame.id = classes;
  return frame;
}

void set_counters(const HostErrorCounters& host, protocol::Frame& frame) {
  frame.data[6] = static_cast<std::uint8_t>(std::min(host.transmit_errors, 255));
  frame.data[7] = static_cast<std::uint8_t>(host.receive_errors);
}

}  // namespace

protocol::Frame report_error(HostErrorCounters& host, bool sending) {
  protocol::Frame frame = error_frame(kClassProtocol | kClassBusError | kClassCounters);
  int& counter = sending ? host.transmit_errors : host.receive_errors;
  const int before = counter;
  if (sending) {
    counter += kErrorStep;
    frame.data[1] = reached(before, counter, kTransmitWarning, kTransmitPassive);
    // The error flags of the receivers hit the frame's end-of-frame field.
    frame.data[2] = kOnTransmission | kNoRecessiveBit;
    frame.data[3] = kInEndOfFrame;
  } else {
    counter = std::min(counter + 1, kMaxReceiveErrors);
    frame.data[1] = reached(before, counter, kReceiveWarning, kReceivePassive);
    frame.data[3] = kInCrc;
  }
  if (frame.data[1] != 0) frame.id |= kClassController;
  if (host.transmit_errors >= kBusOff) frame.id |= kClassBusOff;
  set_counters(host, frame);
  return frame;
}

std::optional<protocol::Frame> report_no_ack(HostErrorCounters& host, bool first) {
  const int before = host.transmit_errors;
  host.transmit_errors = std::max(before, std::min(before + kErrorStep, kErrorPassive));
  protocol::Frame frame = error_frame(kClassCounters);
  frame.data[1] = reached(before, host.transmit_errors, kTransmitWarning, kTransmitPassive);
  if (!first && frame.data[1] == 0) return std::nullopt;
  if (first) frame.id |= kClassNoAck;
  if (frame.data[1] != 0) frame.id |= kClassController;
  set_counters(host, frame);
  return frame;
}

protocol::Frame report_bus_off(bool restarted) {
  return error_frame(restarted ? kClassRestarted : kClassBusOff);
}

protocol::Frame report_overrun() {
  protocol::Frame frame = error_frame(kClassController);
  frame.data[1] = kReceiveOverflow;
  return frame;
}

void count_success(HostErrorCounters& host, bool sending) {
  if (sending) {
    host.transmit_errors = std::max(host.transmit_errors - 1, 0);
  } else if (host.receive_errors >= kErrorPassive) {
    host.receive_errors = kBackFromPassive;
  } else {
    host.receive_errors = std::max(host.receive_errors - 1, 0);
  }
}

}  // namespace lk::emulator
