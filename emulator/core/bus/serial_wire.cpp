#include "emulator/core/bus/serial_wire.hpp"

#include <algorithm>
#include <cassert>
#include <tuple>
#include <utility>

#include "emulator/core/seed.hpp"
#include "emulator/core/wire_timing.hpp"
#include "protocol/multi_drive_commands.hpp"

namespace lk::emulator {

using protocol::Frame;
using protocol::FrameKind;
using Sending = SerialWire::Sending;
using Waiting = SerialWire::Waiting;

namespace {

/// Finds the frame of this sender in `sending`, which holds at most one per sender.
auto sent_by(auto& sending, std::uint32_t owner) {
  return std::ranges::find_if(sending,
                              [owner](const Sending& one) { return one.what.owner == owner; });
}

bool is_sending(const std::vector<Sending>& sending, std::uint32_t owner) {
  return sent_by(sending, owner) != sending.end();
}

/// Returns true if `first` began earlier or, at equal starts, comes first in the list of frames.
/// Pre: both are in the same list.
bool is_first(const Sending& first, const Sending& second) {
  return first.start < second.start || (first.start == second.start && &first < &second);
}

/// Marks `other` as overlapped by the frame `ended` until `until`.
void mark_overlap(const Sending& ended, Sending& other, SimTime until) {
  if (&other == &ended || other.start >= until) return;
  other.covered_until = std::max(other.covered_until, until);
  if (!is_first(ended, other)) return;
  other.merged_until = std::max(other.merged_until, until);
  if (ended.what.owner == SerialWire::kHost) return;
  other.merged_for_host_until = std::max(other.merged_for_host_until, until);
}

WireDelivery delivery_of(const Sending& one, const std::optional<Frame>& packet) {
  const Waiting& what = one.what;
  WireDelivery delivery{one.end, what.frame, what.owner == SerialWire::kHost, what.after_rom_write,
                        what.owner};
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

}  // namespace

SerialWire::Sending::Sending(const Waiting& frame, SimTime free_at, std::int64_t bit_s)
    : what(frame),
      bitrate(bit_s),
      bytes(protocol::wire_bytes(frame.frame)),
      start(std::max(frame.at, free_at)),
      end(byte_time(bytes.size)) {}

SimTime SerialWire::Sending::byte_time(std::size_t byte) const {
  return start + bits_duration(kSerialBitsPerByte * static_cast<std::int64_t>(byte), bitrate);
}

SerialWire::SerialWire(std::int64_t bitrate, const protocol::ReceiverRules& rules,
                       std::uint64_t seed, bool receives_while_replying)
    : bitrate_(bitrate),
      receives_while_replying_(receives_while_replying),
      receiver_(rules),
      random_(seed) {
  assert(bitrate >= 0);
}

// --- senders

std::size_t SerialWire::host_queue_size() const {
  return hosts_.size() + (is_sending(sending_, kHost) ? 1 : 0);
}

std::size_t SerialWire::host_frames_ready(SimTime now) const {
  const auto is_ready = [now](const Waiting& one) { return one.at <= now; };
  const auto sent = sent_by(sending_, kHost);
  return static_cast<std::size_t>(std::ranges::count_if(hosts_, is_ready)) +
         (sent != sending_.end() && is_ready(sent->what) ? 1 : 0);
}

bool SerialWire::cannot_receive(std::uint32_t owner, SimTime end) const {
  const auto sent = sent_by(sending_, owner);
  if (receives_while_replying_) return sent != sending_.end() && sent->start < end;
  return sent != sending_.end() || std::ranges::count(drives_, owner, &Waiting::owner) > 0;
}

bool SerialWire::drive_queue_full(std::uint32_t owner, std::size_t elsewhere) const {
  const auto waiting = std::ranges::count(drives_, owner, &Waiting::owner);
  return static_cast<std::size_t>(waiting) + (is_sending(sending_, owner) ? 1 : 0) + elsewhere >=
         kDriveQueue;
}

std::size_t SerialWire::drive_frames() const {
  return drives_.size() + sending_.size() - (is_sending(sending_, kHost) ? 1 : 0);
}

std::size_t SerialWire::copies(std::uint32_t owner, const Frame& frame) const {
  const auto same = [&](const Waiting& one) { return one.owner == owner && one.frame == frame; };
  const auto sent = sent_by(sending_, owner);
  return static_cast<std::size_t>(std::ranges::count_if(drives_, same)) +
         (sent != sending_.end() && same(sent->what) ? 1 : 0);
}

void SerialWire::send_from_host(SimTime at, const Frame& frame, std::uint32_t) {
  assert(!host_queue_full() && protocol::is_serial(frame) && frame.dlc > 0);
  const Waiting what{.at = at, .frame = frame};
  if (is_sending(sending_, kHost)) {
    hosts_.push_back(what);
    host_bytes_ += protocol::wire_bytes(frame).size;
  } else {
    sending_.emplace_back(what, host_free_at_, bitrate_);
  }
}

void SerialWire::send_from_drive(SimTime at, const Frame& frame, std::uint64_t after_rom_write,
                                 std::uint32_t owner, bool blocked) {
  assert(owner != kHost && !drive_queue_full(owner));
  const Waiting what{at, frame, after_rom_write, owner, blocked};
  if (blocked || is_sending(sending_, owner) ||
      std::ranges::count(drives_, owner, &Waiting::owner) > 0) {
    drives_.push_back(what);
  } else {
    sending_.emplace_back(what, at, bitrate_);
  }
}

/// Moves the next frame of a sender to sending_. Pre: the sender has no frame there.
void SerialWire::begin_next(std::uint32_t owner, SimTime free_at) {
  if (owner == kHost) {
    host_free_at_ = free_at;
    if (hosts_.empty()) return;
    sending_.emplace_back(hosts_.front(), free_at, bitrate_);
    host_bytes_ -= sending_.back().bytes.size;
    hosts_.pop_front();
    return;
  }
  const auto next = std::ranges::find_if(
      drives_, [owner](const Waiting& one) { return one.owner == owner && !one.blocked; });
  if (next == drives_.end()) return;
  sending_.emplace_back(*next, free_at, bitrate_);
  drives_.erase(next);
}

std::size_t SerialWire::block(std::uint32_t owner, SimTime now) {
  const auto own = sent_by(sending_, owner);
  if (own != sending_.end() && own->start >= now) {  // a frame that has begun is completed
    drives_.push_back(own->what);
    std::rotate(drives_.begin(), drives_.end() - 1, drives_.end());  // remains the drive's first
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
  if (!is_sending(sending_, owner)) begin_next(owner, now);
}

std::size_t SerialWire::drop_replies(std::uint32_t owner, SimTime now) {
  const auto own = sent_by(sending_, owner);
  const std::size_t count =
      std::erase_if(drives_, [owner](const Waiting& one) { return one.owner == owner; });
  if (own == sending_.end()) return count;
  if (own->start < now) {
    for (Sending& other : sending_) mark_overlap(*own, other, now);
  }
  sending_.erase(own);
  return count + 1;
}

// --- bytes on the line

/// Returns true if the bytes of `one` must be processed one by one, because drives may not receive
/// them as exactly one intact packet.
bool SerialWire::goes_by_bytes(const Sending& one) const {
  if (one.bytes.size == 0) return false;
  const bool overlaps = std::ranges::any_of(sending_, [&](const Sending& other) {
    return &other != &one && one.start < other.end && other.start < one.end;
  });
  if (one.processed > 0 || one.covered_until > one.start || one.spoilt || overlaps) return true;
  if (one.what.owner != kHost) {
    return line_hold_ > SimTime{0} && one.start < host_free_at_ + line_hold_;
  }
  const Frame& frame = one.what.frame;
  return frame.kind == FrameKind::kBytes || frame.id >= protocol::MultiTorque::kIdentifier ||
         !receiver_.idle() || frame.dlc - 1 > receiver_.rules().max_len;
}

SimTime SerialWire::due(const Sending& one) const {
  return goes_by_bytes(one) ? one.byte_time(one.processed + 1) : one.end;
}

std::size_t SerialWire::next_sending() const {
  std::size_t first = 0;
  SimTime first_due = sending_.empty() ? SimTime{0} : due(sending_.front());
  for (std::size_t n = 1; n < sending_.size(); ++n) {
    const SimTime at = due(sending_[n]);
    if (std::tie(at, sending_[n].start) < std::tie(first_due, sending_[first].start)) {
      first = n;
      first_due = at;
    }
  }
  return first;
}

std::optional<SimTime> SerialWire::next_due() const {
  return sending_.empty() ? std::nullopt : std::optional(due(sending_[next_sending()]));
}

std::optional<SimTime> SerialWire::next_reply_start() const {
  if (sending_.empty()) return std::nullopt;
  const Sending& next = sending_[next_sending()];
  return next.what.owner != kHost ? std::optional(next.start) : std::nullopt;
}

WireCandidate SerialWire::next() const {
  assert(!sending_.empty());
  const Sending& next = sending_[next_sending()];
  const bool from_host = next.what.owner == kHost;
  WireCandidate candidate{next.what.frame, from_host, next.what.owner};
  if (from_host && goes_by_bytes(next)) candidate.frame.kind = FrameKind::kBytes;
  return candidate;
}

bool SerialWire::take_fault_chance() {
  assert(!sending_.empty());
  Sending& next = sending_[next_sending()];
  return next.processed == 0 && !std::exchange(next.faults_applied, true);
}

void SerialWire::spoil_next() {
  Sending& next = sending_[next_sending()];
  if (next.bytes.size > 0) next.spoilt = mix(random_++) % next.bytes.size;
}

std::optional<Frame> SerialWire::process_byte(Sending& one) {
  const std::size_t place = one.processed++;
  const SimTime begin = one.byte_time(place);
  const SimTime end = one.byte_time(place + 1);
  std::uint8_t value = one.bytes.bytes[place];
  // Spoiled by a fault, or by overlap with a frame that has ended.
  bool spoiled = one.spoilt == place || begin < one.covered_until;
  if (one.what.owner != kHost && line_hold_ > SimTime{0} && begin < host_free_at_ + line_hold_) {
    spoiled = one.met_host = true;
  }
  bool merged = begin < one.merged_until;
  bool merged_for_host = begin < one.merged_for_host_until;
  for (const Sending& other : sending_) {
    if (&other == &one || other.start >= end || other.end <= begin) continue;
    // Index of the last byte of `other` that begins before the byte of `one` ends.
    std::size_t beside = 0;
    while (beside + 1 < other.bytes.size && other.byte_time(beside + 1) < end) ++beside;
    const bool together = other.byte_time(beside) == begin;
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

std::optional<WireDelivery> SerialWire::deliver(SimTime until) {
  if (sending_.empty()) return std::nullopt;
  const auto place = sending_.begin() + static_cast<std::ptrdiff_t>(next_sending());
  Sending& one = *place;
  if (due(one) > until) return std::nullopt;
  const std::size_t bytes = goes_by_bytes(one) ? one.processed + 1 : one.bytes.size;
  std::optional<Frame> packet;
  while (one.processed < bytes) packet = process_byte(one);
  const bool from_host = one.what.owner == kHost;
  if (one.processed < one.bytes.size) {
    if (!packet || !from_host) return std::nullopt;  // packets of drives are no queries
    return WireDelivery{one.byte_time(one.processed), *packet, true, 0, kHost, true};
  }
  const WireDelivery delivery = delivery_of(one, packet);
  busy_ += one.end - one.start;
  for (Sending& other : sending_) mark_overlap(one, other, one.end);
  const std::uint32_t owner = one.what.owner;
  const SimTime end = one.end;
  if (from_host) written_ = one.what.frame;
  sending_.erase(place);
  begin_next(owner, end);
  return delivery;
}

}  // namespace lk::emulator
