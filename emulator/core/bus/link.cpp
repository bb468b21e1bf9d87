#include "emulator/core/bus/link.hpp"

#include <algorithm>
#include <utility>

namespace lk::emulator {

bool DriveLink::full(const Wire& wire) const {
  return wire([&](auto& on) { return on.drive_queue_full(owner, held_back ? 1 : 0); });
}

std::size_t DriveLink::send(Wire& wire, const Outgoing& out) {
  if (full(wire)) return 1;
  last_reply = std::max(out.ready, last_reply);
  wire([&](auto& on) {
    on.send_from_drive(last_reply, out.frame, out.after_rom_write, owner, blocked);
  });
  return 0;
}

std::size_t DriveLink::send_all(Wire& wire, const std::vector<Outgoing>& out) {
  std::size_t lost = 0;
  std::optional<Outgoing> behind = std::exchange(held_back, std::nullopt);
  for (const Outgoing& one : out) {
    if (one.held_back) {
      held_back = one;
      continue;
    }
    lost += send(wire, one);
    if (behind) lost += send(wire, *std::exchange(behind, std::nullopt));
  }
  if (behind) held_back = behind;  // no frame was sent that it could follow
  return lost;
}

bool DriveLink::babble(Wire& wire, const protocol::Frame& frame, SimTime now) const {
  if (bus_off || full(wire)) return false;
  return wire([&](auto& on) {
    const bool room = on.copies(owner, frame) < 2;
    if (room) on.send_from_drive(now, frame, 0, owner, blocked);
    return room;
  });
}

std::size_t DriveLink::drop_all(Wire& wire, SimTime now) {
  const std::size_t lost =
      wire([&](auto& on) { return on.drop_replies(owner, now); }) + (held_back ? 1 : 0);
  held_back.reset();
  last_frame.reset();
  last_reply = SimTime{0};
  return lost;
}

std::size_t DriveLink::block(Wire& wire, SimTime now) {
  blocked = true;
  return wire([&](auto& on) { return on.block(owner, now); });
}

void DriveLink::release(Wire& wire, SimTime now) {
  blocked = false;
  wire([&](auto& on) { on.release(owner, now); });
}

std::size_t DriveLink::release_held_back(Wire& wire, SimTime now) {
  if (!held_back) return 0;
  Outgoing late = *std::exchange(held_back, std::nullopt);
  late.ready = std::max(late.ready, now);
  return send(wire, late);
}

}  // namespace lk::emulator
