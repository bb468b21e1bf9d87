#include "emulator/rom/rom_gate.hpp"

#include <algorithm>

namespace lk::emulator {
namespace {

/// Identifiers of drives' replies are a multiple of 64 plus the ID.
int drive_of(const TimedFrame& reply) {
  return reply.said_by != 0 ? reply.said_by : static_cast<int>(reply.frame.id & 0x3FU);
}

}  // namespace

RomGate::RomGate(const BusConfig& bus) {
  for (const ServoConfig& servo : bus.servos) drives_[servo.id].kept = {servo.rom, servo.wear};
}

void RomGate::pass(const TimedFrame& reply, std::vector<protocol::Frame>& out) {
  if (reply.frame.kind == protocol::FrameKind::kError || reply.echo) {
    out.push_back(reply.frame);  // not a reply
    return;
  }
  Drive& drive = drives_.at(drive_of(reply));
  if (drive.held.empty() && reply.after_rom_write <= drive.settled) {
    release(drive, reply, out);
  } else if (drive.held.size() < kMostHeld) {
    drive.held.push_back(reply);
  } else {
    ++lost_replies_;
  }
}

const RomGate::Kept* RomGate::settle(const RomWrite& write, bool durable,
                                     std::vector<protocol::Frame>& out) {
  Drive& drive = drives_.at(write.id);
  if (durable) {
    drive.kept = {write.rom, write.wear};
  } else {
    // Merges consecutive failures: settings, which no reply acknowledges, may fail without limit.
    if (!drive.failed.empty() && drive.failed.back().last == drive.settled) {
      drive.failed.back().last = write.number;
    } else {
      drive.failed.push_back({drive.settled, write.number});
    }
    ++failed_writes_;
  }
  drive.settled = write.number;
  while (!drive.held.empty() && drive.held.front().after_rom_write <= drive.settled) {
    release(drive, drive.held.front(), out);
    drive.held.pop_front();
  }
  // A later pending write includes the values of this one.
  return !durable && drive.begun == write.number ? &drive.kept : nullptr;
}

void RomGate::release(Drive& drive, const TimedFrame& reply, std::vector<protocol::Frame>& out) {
  const std::uint64_t number = reply.after_rom_write;
  if (number == 0) {
    out.push_back(reply.frame);
    return;
  }
  while (!drive.failed.empty() && drive.failed.front().last < number) drive.failed.pop_front();
  if (!drive.failed.empty() && number > drive.failed.front().after) {
    ++lost_replies_;
  } else {
    out.push_back(reply.frame);
  }
}

std::size_t RomGate::waiting() const {
  const auto waits = [](const auto& entry) { return entry.second.begun > entry.second.settled; };
  return static_cast<std::size_t>(std::ranges::count_if(drives_, waits));
}

}  // namespace lk::emulator
