#include "emulator/core/wire/serial_wire.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "emulator/core/seed.hpp"
#include "emulator/core/wire_timing.hpp"
#include "protocol/multi_drive_commands.hpp"

namespace lk::emulator {

using protocol::Frame;
using protocol::FrameKind;

SerialWire::SerialWire(std::int64_t bitrate, const protocol::ReceiverRules& rules,
                       std::uint64_t seed, bool receives_while_replying)
    : bitrate_(bitrate),
      receives_while_replying_(receives_while_replying),
      receiver_(rules),
      random_(seed) {
  assert(bitrate >= 0);
}

SimTime SerialWire::bits(int count) const {
  return bitrate_ > 0 ? bits_duration(count, bitrate_) : SimTime{0};
}

/// Start of a byte, which is the end of the byte before.
SimTime SerialWire::byte_time(const Sending& one, std::size_t byte) const {
  return one.start + bits(kSerialBitsPerByte * static_cast<int>(byte));
}

// --- senders

bool SerialWire::host_sends() const {
  return std::ranges::any_of(sending_, [](const Sending& one) { return one.what.owner == kHost; });
}

std::size_t SerialWire::host_frames_ready(SimTime now) const {
  const auto is_ready = [now](const Waiting& one) { return one.at <= now; };
  const bool sends = std::ranges::any_of(
      sending_, [&](const Sending& one) { return one.what.owner == kHost && is_ready(one.what); });
  return static_cast<std::size_t>(std::ranges::count_if(hosts_, is_ready)) + (sends ? 1 : 0);
}

std::size_t SerialWire::of_drive(std::uint32_t owner) const {
  const auto sent = std::ranges::count_if(
      sending_, [owner](const Sending& one) { return one.what.owner == owner; });
  return static_cast<std::size_t>(sent + std::ranges::count(drives_, owner, &Waiting::owner));
}

bool SerialWire::cannot_receive(std::uint32_t owner, SimTime end) const {
  if (!receives_while_replying_) return of_drive(owner) > 0;
  return std::ranges::any_of(
      sending_, [&](const Sending& one) { return one.what.owner == owner && one.start < end; });
}

bool SerialWire::drive_queue_full(std::uint32_t owner, std::size_t elsewhere) const {
  return of_drive(owner) + elsewhere >= kDriveQueue;
}

std::size_t SerialWire::drive_frames() const {
  return drives_.size() + sending_.size() - (host_sends() ? 1 : 0);
}

std::size_t SerialWire::copies(std::uint32_t owner, const Frame& frame) const {
  const auto same = [&](const Waiting& one) { return one.owner == owner && one.frame == frame; };
  return static_cast<std::size_t>(
      std::ranges::count_if(drives_, same) +
      std::ranges::count_if(sending_, [&](const Sending& one) { return same(one.what); }));
}

SerialWire::Sending SerialWire::begin(const Waiting& what, SimTime free_at) const {
  Sending one{.what = what, .bytes = protocol::wire_bytes(what.frame)};
  one.start = std::max(what.at, free_at);
  one.end = byte_time(one, one.bytes.size);
  return one;
}

void SerialWire::send_from_host(SimTime at, const Frame& frame) {
  assert(!host_queue_full() && protocol::is_serial(frame) && frame.dlc > 0);
  const Waiting what{.at = at, .frame = frame};
  if (host_sends()) {
    hosts_.push_back(what);
    host_bytes_ += protocol::wire_bytes(frame).size;
  } else {
    sending_.push_back(begin(what, host_free_at_));
  }
}

void SerialWire::send_from_drive(SimTime at, const Frame& frame, std::uint64_t after_rom_write,
                                 std::uint32_t owner, bool blocked) {
  assert(owner != kHost && !drive_queue_full(owner));
  const Waiting what{at, frame, after_rom_write, owner, blocked};
  if (blocked || of_drive(owner) > 0) {
    drives_.push_back(what);
  } else {
    sending_.push_back(begin(what, at));
  }
}

/// Starts the next frame of a sender that has none on the wire.
void SerialWire::begin_next(std::uint32_t owner, SimTime free_at) {
  if (owner == kHost) {
    host_free_at_ = free_at;
    if (hosts_.empty()) return;
    sending_.push_back(begin(hosts_.front(), free_at));
    host_bytes_ -= sending_.back().bytes.size;
    hosts_.pop_front();
    return;
  }
  const auto next = std::ranges::find_if(
      drives_, [owner](const Waiting& one) { return one.owner == owner && !one.blocked; });
  if (next == drives_.end()) return;
  sending_.push_back(begin(*next, free_at));
  drives_.erase(next);
}

std::size_t SerialWire::block(std::uint32_t owner, SimTime now) {
  const auto own = std::ranges::find_if(
      sending_, [owner](const Sending& one) { return one.what.owner == owner; });
  if (own != sending_.end() && own->start >= now) {  // else it is completed
    drives_.push_back(own->what);
    std::rotate(drives_.begin(), drives_.end() - 1, drives_.end());  // it stays the first
    sending_.erase(own);
  }
  std::size_t count = 0;
  for (Waiting& one : drives_) {
    if (one.owner != owner) continue;
    one.blocked = true;
    ++count;
  }
  return count;
}

void SerialWire::release(std::uint32_t owner, SimTime now) {
  for (Waiting& one : drives_) {
    if (one.owner != owner) continue;
    one.blocked = false;
    one.at = std::max(one.at, now);
  }
  const auto own = [owner](const Sending& one) { return one.what.owner == owner; };
  if (std::ranges::none_of(sending_, own)) begin_next(owner, now);
}

std::size_t SerialWire::drop_replies(std::uint32_t owner, SimTime now) {
  const auto own = std::ranges::find_if(
      sending_, [owner](const Sending& one) { return one.what.owner == owner; });
  std::size_t count =
      std::erase_if(drives_, [owner](const Waiting& one) { return one.owner == owner; });
  if (own == sending_.end()) return count;
  if (own->start < now) {
    for (Sending& other : sending_) mark_overlap(*own, other, now);
  }
  sending_.erase(own);
  return count + 1;
}

// --- bytes on the line

bool SerialWire::overlaps(const Sending& one) const {
  return std::ranges::any_of(sending_, [&](const Sending& other) {
    return &other != &one && one.start < other.end && other.start < one.end;
  });
}

/// Its bytes must be processed one by one: they may not be exactly one intact packet.
bool SerialWire::goes_by_bytes(const Sending& one) const {
  if (one.bytes.size == 0) return false;
  if (one.processed > 0 || one.covered_until > one.start || one.spoilt || overlaps(one))
    return true;
  if (one.what.owner != kHost) return line_hold_ > SimTime{0} && host_holds(one.start);
  const Frame& frame = one.what.frame;
  return frame.kind == FrameKind::kBytes || frame.id >= protocol::MultiTorque::kIdentifier ||
         !receiver_.idle() || frame.dlc - 1 > receiver_.rules().max_len;
}

SimTime SerialWire::due(const Sending& one) const {
  return goes_by_bytes(one) ? byte_time(one, one.processed + 1) : one.end;
}

/// The frame with the earliest due bytes; at equal times the one that began first.
const SerialWire::Sending* SerialWire::next_sending() const {
  const Sending* first = nullptr;
  SimTime first_due{0};
  for (const Sending& one : sending_) {
    const SimTime at = due(one);
    if (first == nullptr || at < first_due || (at == first_due && one.start < first->start)) {
      first = &one;
      first_due = at;
    }
  }
  return first;
}

std::optional<SimTime> SerialWire::next_due() const {
  const Sending* const next = next_sending();
  return next != nullptr ? std::optional(due(*next)) : std::nullopt;
}

std::optional<SimTime> SerialWire::next_reply_start() const {
  const Sending* const next = next_sending();
  return next != nullptr && next->what.owner != kHost ? std::optional(next->start) : std::nullopt;
}

WireCandidate SerialWire::next() const {
  const Sending* const next = next_sending();
  assert(next != nullptr);
  const bool from_host = next->what.owner == kHost;
  WireCandidate candidate{next->what.frame, from_host, next->what.owner};
  if (from_host && goes_by_bytes(*next)) candidate.frame.kind = FrameKind::kBytes;
  return candidate;
}

bool SerialWire::take_fault_chance() {
  assert(next_sending() != nullptr);
  Sending& next = next_of_all();
  return next.processed == 0 && !std::exchange(next.faults_applied, true);
}

void SerialWire::spoil_next() {
  Sending& next = next_of_all();
  if (next.bytes.size > 0) next.spoilt = mix(random_++) % next.bytes.size;
}

void SerialWire::mark_overlap(const Sending& ended, Sending& other, SimTime until) {
  if (&other == &ended || other.start >= until) return;
  other.covered_until = std::max(other.covered_until, until);
  if (!is_first(ended, other)) return;
  other.merged_until = std::max(other.merged_until, until);
  if (ended.what.owner == kHost) return;
  other.merged_for_host_until = std::max(other.merged_for_host_until, until);
}

std::optional<Frame> SerialWire::process_byte(Sending& one) {
  const std::size_t place = one.processed++;
  const SimTime begin = byte_time(one, place);
  const SimTime end = byte_time(one, place + 1);
  std::uint8_t value = one.bytes.bytes[place];
  // Spoiled by a fault, or by overlap with a frame that has ended.
  bool spoiled = one.spoilt == place || begin < one.covered_until;
  if (one.what.owner != kHost && line_hold_ > SimTime{0} && host_holds(begin)) {
    spoiled = one.met_host = true;
  }
  bool merged = begin < one.merged_until;
  bool merged_for_host = begin < one.merged_for_host_until;
  for (const Sending& other : sending_) {
    if (&other == &one || other.start >= end || other.end <= begin) continue;
    // Index of the other's last byte that begins before the end of this one.
    std::size_t beside = 0;
    while (beside + 1 < other.bytes.size && byte_time(other, beside + 1) < end) ++beside;
    const bool together = byte_time(other, beside) == begin;
    const bool equal = together && other.bytes.bytes[beside] == one.bytes.bytes[place];
    spoiled = spoiled || !equal;
    merged = merged || is_first(other, one);
    merged_for_host = merged_for_host || (is_first(other, one) && other.what.owner != kHost);
  }
  if (spoiled) value = static_cast<std::uint8_t>(mix(random_++));
  if (spoiled || merged) one.clean = false;
  if (!merged_for_host) one.read[one.read_size++] = value;
  return merged ? std::nullopt : receiver_.feed(value, begin, end);
}

WireDelivery SerialWire::delivery_of(const Sending& one, const std::optional<Frame>& packet) const {
  const Waiting& what = one.what;
  WireDelivery delivery{one.end, what.frame, what.owner == kHost, what.after_rom_write, what.owner};
  delivery.met_host = one.met_host;
  if (delivery.from_host && packet) {
    delivery.frame = *packet;
  } else if (delivery.from_host || !one.clean) {
    Frame bytes;
    bytes.kind = FrameKind::kBytes;
    bytes.dlc = static_cast<std::uint8_t>(one.read_size);
    std::copy_n(one.read.begin(), one.read_size, bytes.data.begin());
    delivery.frame = bytes;
  }
  return delivery;
}

std::optional<WireDelivery> SerialWire::deliver(SimTime until) {
  const Sending* const next = next_sending();
  if (next == nullptr || due(*next) > until) return std::nullopt;
  const auto place = next - sending_.data();
  Sending& one = next_of_all();
  const std::size_t bytes = goes_by_bytes(one) ? one.processed + 1 : one.bytes.size;
  std::optional<Frame> packet;
  while (one.processed < bytes) packet = process_byte(one);
  const bool from_host = one.what.owner == kHost;
  if (one.processed < one.bytes.size) {
    if (!packet || !from_host) return std::nullopt;  // packets of drives are no queries
    return WireDelivery{byte_time(one, one.processed), *packet, true, 0, kHost, true};
  }
  const WireDelivery delivery = delivery_of(one, packet);
  busy_ += one.end - one.start;
  for (Sending& other : sending_) mark_overlap(one, other, one.end);
  const std::uint32_t owner = one.what.owner;
  const SimTime end = one.end;
  if (from_host) written_ = one.what.frame;
  sending_.erase(sending_.begin() + place);
  begin_next(owner, end);
  return delivery;
}

}  // namespace lk::emulator
