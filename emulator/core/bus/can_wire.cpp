#include "emulator/core/bus/can_wire.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "emulator/core/wire_timing.hpp"
#include "protocol/frame_bits.hpp"
#include "protocol/opcodes.hpp"

namespace lk::emulator {

CanWire::CanWire(std::int64_t bitrate, std::size_t host_queue)
    : bitrate_(bitrate), hosts_(host_queue) {
  assert(bitrate >= 0 && host_queue > 0);
  drives_.reserve(kDriveQueue * protocol::kMaxDrivesPerBus);
}

CanWire::CanFrame::CanFrame(const protocol::Frame& frame)
    : id(frame.id), kind(frame.kind), extended(frame.extended), dlc(frame.dlc) {
  std::copy_n(frame.data.begin(), data.size(), data.begin());
}

CanWire::CanFrame::operator protocol::Frame() const {
  protocol::Frame frame{.id = id, .kind = kind, .extended = extended, .dlc = dlc};
  std::ranges::copy(data, frame.data.begin());
  return frame;
}

CanWire::Waiting CanWire::waiting(SimTime at, const protocol::Frame& frame) const {
  Waiting result{.at = at, .queued_at = at, .frame = CanFrame(frame)};
  if (bitrate_ > 0) {  // else no frame waits: equal priority, no duration
    const int bits = protocol::frame_bits(frame);
    result.priority = protocol::arbitration_field(frame);
    result.length = bits_duration(bits, bitrate_);
    result.occupancy = bits_duration(bits + protocol::kInterframeBits, bitrate_);
  }
  return result;
}

void CanWire::send_from_host(SimTime at, const protocol::Frame& frame, std::uint32_t sender) {
  assert(!host_queue_full());
  if (host_count_ > 0) {
    at = std::max(at, host(host_count_ - 1).at);
  }
  Waiting& last = host(host_count_);
  last = waiting(at, frame);
  last.owner = sender;
  ++host_count_;
  update_next();
}

std::size_t CanWire::host_frames_ready(SimTime now) const {
  std::size_t ready = 0;
  while (ready < host_count_ && hosts_[(host_head_ + ready) % hosts_.size()].at <= now) ++ready;
  return ready;
}

bool CanWire::drop_oldest_from_host(SimTime now) {
  const bool on_wire = next_ && !next_->drive && next_->start <= now;
  const std::size_t oldest = on_wire ? 1 : 0;
  if (host_count_ <= oldest) return false;
  for (std::size_t n = oldest; n + 1 < host_count_; ++n) host(n) = host(n + 1);
  --host_count_;
  update_next();
  return true;
}

std::size_t CanWire::drop_from_hosts(SimTime now) {
  if (next_ && !next_->drive && next_->start <= now) {
    free_at_ = next_->start + sender(*next_).occupancy;
    busy_ += sender(*next_).occupancy;
  }
  const std::size_t count = std::exchange(host_count_, 0);
  update_next();
  return count;
}

bool CanWire::drive_queue_full(std::uint32_t owner, std::size_t elsewhere) const {
  if (drives_.size() + elsewhere < kDriveQueue) {
    return false;
  }
  const auto own = std::ranges::count(drives_, owner, &Waiting::owner);
  return static_cast<std::size_t>(own) + elsewhere >= kDriveQueue;
}

std::size_t CanWire::copies(std::uint32_t owner, const protocol::Frame& frame) const {
  const CanFrame wanted(frame);
  const auto same = [&](const Waiting& reply) {
    return reply.owner == owner && reply.frame == wanted;
  };
  return static_cast<std::size_t>(std::ranges::count_if(drives_, same));
}

void CanWire::send_from_drive(SimTime at, const protocol::Frame& frame,
                              std::uint64_t after_rom_write, std::uint32_t owner, bool blocked) {
  assert(!drive_queue_full(owner));
  drives_.push_back(waiting(at, frame));
  drives_.back().after_rom_write = after_rom_write;
  drives_.back().owner = owner;
  drives_.back().blocked = blocked;
  update_next();
}

std::size_t CanWire::block(std::uint32_t owner, SimTime now) {
  const Waiting* const begun =
      next_ && next_->drive && next_->start < now ? &drives_[*next_->drive] : nullptr;
  std::size_t count = 0;
  for (Waiting& reply : drives_) {
    if (reply.owner == owner && &reply != begun) {
      reply.blocked = true;
      ++count;
    }
  }
  update_next();
  return count;
}

void CanWire::release(std::uint32_t owner, SimTime now) {
  for (Waiting& reply : drives_) {
    if (reply.owner == owner && reply.blocked) {
      reply.blocked = false;
      reply.at = std::max(reply.at, now);
    }
  }
  update_next();
}

std::size_t CanWire::drop_replies(std::uint32_t owner, SimTime now) {
  if (next_ && next_->drive && next_->start <= now && sender(*next_).owner == owner) {
    free_at_ = next_->start + sender(*next_).occupancy;
    busy_ += sender(*next_).occupancy;
  }
  const std::size_t count =
      std::erase_if(drives_, [owner](const Waiting& reply) { return reply.owner == owner; });
  update_next();
  return count;
}

std::optional<CanWire::Transmission> CanWire::next_transmission() const {
  std::optional<SimTime> first;
  if (host_count_ > 0) {
    first = host_ready();
  }
  for (const Waiting& reply : drives_) {
    if (reply.blocked) {
      continue;
    }
    first = first ? std::min(*first, reply.at) : reply.at;
  }
  if (!first) {
    return std::nullopt;
  }
  // All frames waiting when the wire becomes free start together; the lowest arbitration field
  // wins.
  Transmission transmission{
      .start = std::max(*first, free_at_), .end = SimTime{0}, .drive = std::nullopt};
  const Waiting* winner = nullptr;
  for (std::size_t k = 0; k < drives_.size(); ++k) {
    const Waiting& reply = drives_[k];
    if (!reply.blocked && reply.at <= transmission.start &&
        (winner == nullptr || reply.priority < winner->priority)) {
      winner = &reply;
      transmission.drive = k;
    }
  }
  // Query and reply of a drive have the same identifier, so both may start, and neither sender
  // backs off. On a real wire both then have a bit error and retry; here the reply goes first.
  if (host_count_ > 0) {
    const Waiting& head = hosts_[host_head_];
    if (host_ready() <= transmission.start &&
        (winner == nullptr || head.priority < winner->priority)) {
      transmission.drive.reset();
    }
  }
  transmission.end = transmission.start + sender(transmission).length;
  return transmission;
}

const CanWire::Waiting& CanWire::sender(const Transmission& transmission) const {
  return transmission.drive ? drives_[*transmission.drive] : hosts_[host_head_];
}

void CanWire::remove(const Transmission& transmission) {
  if (transmission.drive) {
    drives_.erase(drives_.begin() + static_cast<std::ptrdiff_t>(*transmission.drive));
  } else {
    host_head_ = (host_head_ + 1) % hosts_.size();
    --host_count_;
  }
}

std::optional<WireDelivery> CanWire::deliver(SimTime until) {
  if (!next_ || next_->end > until) {
    return std::nullopt;
  }
  const Transmission transmission = *next_;
  const Waiting& frame = sender(transmission);
  std::optional<WireDelivery> delivery(std::in_place);  // avoids a second copy of the frame
  delivery->at = transmission.end;
  delivery->queued_at = frame.queued_at;
  delivery->frame = protocol::Frame(frame.frame);
  delivery->from_host = !transmission.drive;
  delivery->after_rom_write = frame.after_rom_write;
  delivery->owner = frame.owner;
  free_at_ = transmission.start + frame.occupancy;
  busy_ += frame.occupancy;
  remove(transmission);
  update_next();
  return delivery;
}

WireCandidate CanWire::next() const {
  assert(next_);
  const Waiting& frame = sender(*next_);
  return {protocol::Frame(frame.frame), !next_->drive, frame.owner};
}

/// Occupies the wire for the frame with its error frame and the intermission.
void CanWire::break_off(const Transmission& transmission, int error_bits) {
  const SimTime occupancy =
      sender(transmission).length + bits_duration(error_bits + protocol::kInterframeBits, bitrate_);
  free_at_ = transmission.start + occupancy;
  busy_ += occupancy;
}

void CanWire::destroy(int pause_bits, int error_bits) {
  assert(next_);
  break_off(*next_, error_bits);
  Waiting& frame = next_->drive ? drives_[*next_->drive] : hosts_[host_head_];
  frame.at = free_at_ + bits_duration(pause_bits, bitrate_);
  update_next();
}

void CanWire::destroy_for_good(int pause_bits) {
  assert(next_);
  break_off(*next_, kErrorDelimiterBits);
  remove(*next_);
  if (!next_->drive) {
    hosts_from_ = free_at_ + bits_duration(pause_bits, bitrate_);
  }
  update_next();
}

}  // namespace lk::emulator
