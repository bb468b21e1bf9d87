// The motors of a bus: how they are made, and brought to the instants at which somebody needs them.

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <utility>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/wire_timing.hpp"

namespace lk::emulator {
namespace {

std::int64_t f_pwm_Hz(const ServoConfig& servo) {
  return std::llround(servo.profile.drive.inverter.f_pwm);
}

/// The events begin with this drive's supply switched off.
bool starts_without_power(const BusConfig& config, int id) {
  return std::ranges::any_of(config.events, [id](const TimedDirective& event) {
    return event.at == SimTime{0} && !event.when && event.directive.id == id &&
           std::holds_alternative<PowerOff>(event.directive.what);
  });
}

}  // namespace

/// One bank for each PWM rate, filled in the order of the drives.
std::vector<MotorPlace> Bus::build_motors(const BusConfig& config) {
  std::vector<MotorPlace> places;
  std::vector<std::int64_t> rates_Hz;
  std::vector<std::vector<model::DriveInit>> motors;
  for (const ServoConfig& servo : config.servos) {
    const auto found = std::ranges::find(rates_Hz, f_pwm_Hz(servo));
    const auto bank = static_cast<std::size_t>(std::distance(rates_Hz.begin(), found));
    if (found == rates_Hz.end()) {
      rates_Hz.push_back(f_pwm_Hz(servo));
      motors.emplace_back();
    }
    places.push_back({bank, motors[bank].size()});
    motors[bank].push_back(make_drive(servo, config.seed));
    motors[bank].back().connected = !starts_without_power(config, servo.id);
  }
  for (std::size_t k = 0; k < rates_Hz.size(); ++k) {
    banks_.push_back({rates_Hz[k], model::DriveBank(motors[k])});
  }
  return places;
}

void Bus::settle() {
  while (!settled()) {
    bring_motors_to(time_);
  }
}

bool Bus::bring_motors_to(SimTime t) {
  bool edge = false;
  for (Bank& bank : banks_) {
    // A command that arrives at `t` acts at the first tick after it.
    edge = bank.drives.advance_to_edge(ticks_until(t, bank.f_pwm_Hz)) || edge;
  }
  if (!duplicates_.empty()) {
    bring_duplicates_to(t);
  }
  if (edge) {
    follow_lives();
  } else {
    motors_at_ = t;
  }
  return edge;
}

bool Bus::bring_motor_to(SimTime t, std::size_t index) {
  const MotorPlace& place = nodes_[index].motor;
  Bank& bank = banks_[place.bank];
  const bool edge = bank.drives.advance_to_edge(ticks_until(t, bank.f_pwm_Hz), place.lane);
  if (edge) {
    follow_lives();
  }
  return edge;
}

/// Drives meet on the wire only: without faults and conditions, which look at several, a drive
/// nobody hears of may stay behind. A drive that dies stops there, and those that were brought with
/// it: when its frame is void, nobody is ahead of what happens instead.
bool Bus::bring_concerned_to(SimTime t) {
  if (faults_or_conditions()) {
    return bring_motors_to(t);
  }
  const bool agenda_due = agenda_.next_due() && *agenda_.next_due() <= t;
  const bool wire_due = wire_.next_due() && *wire_.next_due() <= t;
  const std::optional<SimTime> start = wire_.next_reply_start();
  const bool replies = start && *start <= t;
  // A reply that ends later: whoever waits behind it might have had the wire by then.
  if (!agenda_due && !wire_due && !(replies && wire_.several_wait())) {
    return false;
  }
  if (nodes_.size() == 1) {
    return bring_motors_to(t);
  }
  if (replies && bring_motor_to(t, index_of(static_cast<int>(wire_.next().owner & 0x3FU)))) {
    return true;
  }
  if (agenda_due || replies) {
    return agenda_due && bring_motors_to(t);
  }
  const auto addressed = protocol::address(wire_.next().frame);
  const int* const id = std::get_if<int>(&addressed);
  if (id != nullptr && *id == protocol::kMultiDrive) {
    return bring_motors_to(t);
  }
  return id != nullptr && has(*id) && bring_motor_to(t, index_of(*id));
}

/// Some drive has died or come alive. Drives may be far apart then; they meet on the wire only, and
/// nothing of a drive's happens there before it has been brought to it.
void Bus::follow_lives() {
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const Bank& bank = banks_[nodes_[k].motor.bank];
    const bool alive = bank.drives.alive(nodes_[k].motor.lane);
    if (alive == nodes_[k].timeline.alive) {
      continue;
    }
    nodes_[k].timeline.alive = alive;
    if (alive) {
      nodes_[k].servo.power_cycle(lane(k));
      book_firmware(k);
    } else {
      // A frame that starts as the tick ends does not start.
      lose_power(k,
                 time_of_tick(bank.drives.ticks(nodes_[k].motor.lane), bank.f_pwm_Hz) - SimTime{1});
    }
  }
}

/// What it was about to say is lost, and so is what its memory had not taken yet.
void Bus::lose_power(std::size_t index, SimTime at) {
  Timeline& timeline = nodes_[index].timeline;
  forget_words(index, at);
  nodes_[index].link.errors = 0;
  if (std::exchange(nodes_[index].link.bus_off, false)) {
    agenda_.forget<BusOffEnd>(index);
  }
  if (!timeline.writing.empty()) {
    nodes_[index].servo.restore_rom(timeline.writing.front().rom_before,
                                    timeline.writing.front().wear_before);
    timeline.writing.clear();
    agenda_.forget<RomWritten>(index);
  }
}

Lane Bus::lane(std::size_t index) {
  return {banks_[nodes_[index].motor.bank].drives, nodes_[index].motor.lane};
}

model::Telemetry Bus::telemetry(int id) const {
  assert(settled());
  const MotorPlace& place = nodes_[index_of(id)].motor;
  return banks_[place.bank].drives.telemetry(place.lane);
}

model::Truth Bus::truth(int id) const {
  assert(settled());
  const MotorPlace& place = nodes_[index_of(id)].motor;
  return banks_[place.bank].drives.truth(place.lane);
}

Surroundings Bus::surroundings(int id) const {
  assert(settled());
  const MotorPlace& place = nodes_[index_of(id)].motor;
  const model::DriveBank& drives = banks_[place.bank].drives;
  const model::DriveParams& params = drives.params(place.lane);
  return {drives.connected(place.lane), params.supply.v_source, params.thermal.temp_ambient,
          params.load};
}

model::Setpoint Bus::setpoint(int id) const {
  assert(settled());
  const MotorPlace& place = nodes_[index_of(id)].motor;
  return banks_[place.bank].drives.setpoint(place.lane);
}

}  // namespace lk::emulator
