#include "emulator/core/bus/memory.hpp"

#include <algorithm>

#include "emulator/core/servo/registers.hpp"

namespace lk::emulator {
namespace {

/// Time step of a voltage ramp.
constexpr SimTime kRampStep = std::chrono::milliseconds(1);

double fraction(SimTime part, SimTime whole) {
  return static_cast<double>(part.count()) / static_cast<double>(whole.count());
}

}  // namespace

void Power::move(double to_V, SimTime now, SimTime within) {
  after_sag_V_.reset();
  ramp_ = {supply_V_, to_V, now, now + within};
}

void Power::sag(double to_V, SimTime now) {
  const double then_V = after_sag_V_.value_or(ramp_ ? ramp_->to_V : supply_V_);
  move(to_V, now, SimTime{0});
  after_sag_V_ = then_V;
}

std::optional<SimTime> Power::step(SimTime now) {
  if (now >= ramp_->end) {
    supply_V_ = ramp_->to_V;
    ramp_.reset();
    return std::nullopt;
  }
  const double share = fraction(now - ramp_->begin, ramp_->end - ramp_->begin);
  supply_V_ = ramp_->from_V + share * (ramp_->to_V - ramp_->from_V);
  return std::min(now + kRampStep, ramp_->end);
}

RomWrite rom_write(const Servo& servo) {
  return {servo.stats.rom_writes, servo.id(), servo.rom, servo.wear};
}

SimTime Memory::begin(SimTime at, const Servo& servo) {
  const SimTime begin = idle() ? at : writes_.back().done;
  const SimTime done = begin + servo.config.flash.write_time;
  writes_.push_back({done, rom_write(servo), servo.rom_before, servo.wear_before});
  return done;
}

RomWrite Memory::finish() {
  const RomWrite written = writes_.front().after;
  writes_.erase(writes_.begin());
  return written;
}

bool Memory::lose_power(Servo& servo) {
  if (idle()) return false;
  restore_rom(servo, writes_.front().rom_before, writes_.front().wear_before);
  writes_.clear();
  return true;
}

bool Memory::damage(RomParameter parameter, const Registers& rom, std::uint32_t wear) {
  const auto cell = static_cast<std::size_t>(parameter);
  for (Write& write : writes_) {
    write.wear_before[cell] += wear;
    write.after.wear[cell] += wear;
    copy_parameter(parameter, rom, write.rom_before);
    copy_parameter(parameter, rom, write.after.rom);
  }
  return !idle();
}

void Memory::set_before(const Registers& rom, const RomWear& wear) {
  writes_.front().rom_before = rom;
  writes_.front().wear_before = wear;
}

}  // namespace lk::emulator
