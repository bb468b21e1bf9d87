#include "emulator/bus.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>

#include "emulator/wire_timing.hpp"

namespace lk::emulator {
namespace {

std::int64_t f_pwm_Hz(const ServoConfig& servo) {
  return std::llround(servo.profile.drive.inverter.f_pwm);
}

Drop drop_cause(protocol::Reject reject) {
  switch (reject) {
    case protocol::Reject::kErrorFrame:
      return Drop::kErrorFrame;
    case protocol::Reject::kCanFd:
      return Drop::kCanFd;
    case protocol::Reject::kRemote:
      return Drop::kRemote;
    case protocol::Reject::kExtended:
      return Drop::kExtended;
    case protocol::Reject::kForeignId:
      return Drop::kForeignId;
    case protocol::Reject::kWrongLength:
      return Drop::kWrongLength;
    case protocol::Reject::kUnknownCommand:
      return Drop::kUnknownCommand;
  }
  return Drop::kForeignId;
}

}  // namespace

Bus::Bus(const BusConfig& config) : bitrate_(config.bitrate), wire_(config.bitrate) {
  seat_of_id_.fill(-1);
  build_motors(config);
  servos_.reserve(config.servos.size());
  rom_writes_.reserve(config.servos.size());
  for (std::size_t k = 0; k < config.servos.size(); ++k) {
    const ServoConfig& servo = config.servos[k];
    assert(servo.id >= protocol::kMinId && servo.id <= protocol::kMaxId && !has(servo.id));
    assert(k == 0 || servo.id > config.servos[k - 1].id);
    seat_of_id_[static_cast<std::size_t>(servo.id)] = static_cast<std::int8_t>(k);
    servos_.emplace_back(servo, lane(k).telemetry());
  }
}

/// One bank for each PWM rate, filled in the order of the seats.
void Bus::build_motors(const BusConfig& config) {
  std::vector<std::int64_t> rates_Hz;
  std::vector<std::vector<model::DriveInit>> motors;
  for (const ServoConfig& servo : config.servos) {
    const auto found = std::ranges::find(rates_Hz, f_pwm_Hz(servo));
    const auto bank = static_cast<std::size_t>(std::distance(rates_Hz.begin(), found));
    if (found == rates_Hz.end()) {
      rates_Hz.push_back(f_pwm_Hz(servo));
      motors.emplace_back();
    }
    places_.push_back({bank, motors[bank].size()});
    motors[bank].push_back(make_drive(servo, config.seed));
  }
  for (std::size_t k = 0; k < rates_Hz.size(); ++k) {
    banks_.push_back({rates_Hz[k], model::DriveBank(motors[k])});
  }
}

void Bus::receive(const TimedFrame& in) {
  ++stats_.frames;
  if (in.frame.kind == protocol::FrameKind::kError) {
    drop(Drop::kErrorFrame);
    return;
  }
  if (in.frame.kind == protocol::FrameKind::kFd) {
    drop(Drop::kCanFd);  // no classical bus carries it
    return;
  }
  const SimTime at = std::max(in.at, time_);
  if (wire_.host_queue_full()) {
    advance_to(at);
  }
  if (wire_.host_queue_full()) {
    drop(Drop::kQueueFull);
    return;
  }
  wire_.send_from_host(at, in.frame);
  stats_.queue_peak = std::max<std::uint64_t>(stats_.queue_peak, wire_.host_queue_size());
}

void Bus::advance_to(SimTime until) {
  process_wire(until);
  time_ = std::max(time_, until);
  for (Bank& bank : banks_) {
    bring_motors_to(bank, time_);
  }
}

void Bus::take_replies(std::vector<TimedFrame>& out) {
  out.insert(out.end(), replies_.begin(), replies_.end());
  replies_.clear();
}

void Bus::take_rom_writes(std::vector<RomWrite>& out) {
  out.insert(out.end(), rom_writes_.begin(), rom_writes_.end());
  rom_writes_.clear();
}

void Bus::restore_rom(int id, const Registers& rom, const RomWear& wear) {
  servos_[seat(id)].restore_rom(rom, wear);
}

std::optional<SimTime> Bus::next_due() const { return wire_.next_due(); }

void Bus::process_wire(SimTime until) {
  while (const auto delivery = wire_.deliver(until)) {
    if (delivery->from_host) {
      process_query(delivery->at, delivery->frame);
    } else {
      replies_.push_back({delivery->at, delivery->frame, delivery->after_rom_write});
      ++stats_.replies;
    }
  }
}

void Bus::process_query(SimTime at, const protocol::Frame& frame) {
  const auto addressed = protocol::address(frame);
  if (const auto* reject = std::get_if<protocol::Reject>(&addressed)) {
    drop(drop_cause(*reject));
    return;
  }
  const int id = std::get<int>(addressed);
  if (id != protocol::kMultiDrive && !has(id)) {
    drop(Drop::kNoSuchDrive);
    return;
  }
  if (id == protocol::kMultiDrive) {
    process_multi_drive(at, frame);
    return;
  }
  Servo& servo = servos_[seat(id)];
  if (servo.multi_drive_mode()) {
    servo.count_wrong_mode();
    drop(Drop::kWrongMode);
    return;
  }
  const auto understood = servo.understand(frame);
  if (const auto* query = std::get_if<protocol::Query>(&understood)) {
    ++stats_.queries;
    answer(at, seat(id), *query);
  } else {
    servo.count_unknown_command();
    drop(Drop::kUnknownCommand);
  }
}

/// Each drive hears the frame in its own way. When none answers, the cause is that of the drive
/// that came closest to it.
void Bus::process_multi_drive(SimTime at, const protocol::Frame& frame) {
  bool heard = false;
  Drop cause = frame.id == protocol::kMultiDriveId ? Drop::kWrongMode : Drop::kForeignId;
  for (std::size_t k = 0; k < servos_.size(); ++k) {
    Servo& servo = servos_[k];
    const auto understood = servo.understand(frame);
    const auto* query = std::get_if<protocol::Query>(&understood);
    if (query == nullptr) {
      const bool unknown =
          std::get<protocol::Reject>(understood) == protocol::Reject::kUnknownCommand;
      if (unknown && servo.multi_drive_mode()) {
        servo.count_unknown_command();
        cause = Drop::kUnknownCommand;
      }
    } else if (servo.multi_drive_mode()) {
      answer(at, k, *query);
      heard = true;
    } else if (cause == Drop::kForeignId) {
      cause = Drop::kWrongMode;
    }
  }
  if (heard) {
    ++stats_.queries;
  } else {
    drop(cause);
  }
}

void Bus::answer(SimTime at, std::size_t seat, const protocol::Query& query) {
  bring_motors_to(banks_[places_[seat].bank], at);
  Servo& servo = servos_[seat];
  const std::uint64_t writes_before = servo.stats().rom_writes;
  const protocol::Reply reply = servo.handle(query, lane(seat));
  std::uint64_t rom_write = 0;
  if (servo.stats().rom_writes != writes_before) {
    rom_write = servo.stats().rom_writes;
    rom_writes_.push_back({rom_write, servo.id(), servo.rom(), servo.wear()});
  }
  const protocol::Frame frame = servo.encode(reply);
  // Without a modelled wire the drive has no reply time either.
  wire_.send_from_drive(bitrate_ > 0 ? at + servo.reply_time() : at, frame, rom_write);
}

/// A command that arrives at `t` acts at the first tick after it.
void Bus::bring_motors_to(Bank& bank, SimTime t) {
  const std::int64_t missing = ticks_until(t, bank.f_pwm_Hz) - bank.drives.ticks();
  if (missing > 0) {
    bank.drives.advance(missing);
  }
}

BusStats Bus::stats() const {
  BusStats sum = stats_;
  sum.wire_busy = wire_.busy();
  for (const Servo& servo : servos_) {
    sum.refused_motion += servo.stats().refused_motion;
    sum.invalid_targets += servo.stats().invalid_targets;
    sum.rom_writes += servo.stats().rom_writes;
  }
  return sum;
}

bool Bus::has(int id) const {
  return id >= protocol::kMinId && id <= protocol::kMaxId &&
         seat_of_id_[static_cast<std::size_t>(id)] >= 0;
}

std::size_t Bus::seat(int id) const {
  assert(has(id));
  return static_cast<std::size_t>(seat_of_id_[static_cast<std::size_t>(id)]);
}

Lane Bus::lane(std::size_t seat) { return {banks_[places_[seat].bank].drives, places_[seat].lane}; }

model::Telemetry Bus::telemetry(int id) const {
  const Place& place = places_[seat(id)];
  return banks_[place.bank].drives.telemetry(place.lane);
}

model::Truth Bus::truth(int id) const {
  const Place& place = places_[seat(id)];
  return banks_[place.bank].drives.truth(place.lane);
}

void Bus::set_load(int id, const model::LoadParams& load) {
  const Lane motor = lane(seat(id));
  motor.bank.set_load(motor.index, load);
}

void Bus::set_supply_voltage(int id, double supply_V) {
  const Lane motor = lane(seat(id));
  motor.bank.set_supply_voltage(motor.index, supply_V);
}

void Bus::set_ambient_temperature(int id, double ambient_C) {
  const Lane motor = lane(seat(id));
  motor.bank.set_ambient_temperature(motor.index, ambient_C);
}

void Bus::power_cycle(int id) {
  const std::size_t k = seat(id);
  servos_[k].power_cycle(lane(k));
}

}  // namespace lk::emulator
