#include "emulator/core/faults/duplicates.hpp"

#include <algorithm>

#include "emulator/core/wire_timing.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {

void Duplicates::add(const FaultBoard& faults, std::size_t fault, const Servo& original,
                     std::int64_t f_pwm_Hz, SimTime now) {
  const LiveFault& live = faults[fault];
  ServoConfig config = original.config();
  // A later write of the encoder offset does not move the shaft.
  config.boot_offset = config.boot_offset.value_or(config.rom.encoder_offset);
  config.rom = original.rom();
  const DrivePlace& place = original.place();
  config.rom.driver_id = static_cast<std::uint8_t>(place.id);
  config.rom.bus_type = static_cast<std::uint8_t>(place.bus);
  config.rom.serial_rate = place.serial_rate;
  config.rom.can_rate = place.can_rate;
  model::DriveInit init = make_drive(config, faults.bus_seed());
  init.theta_m += live.row().duplicate(live);
  init.seed = mix(live.random + static_cast<std::uint64_t>(config.id));
  model::DriveBank motor({&init, 1});
  Servo servo(config, motor.telemetry(0));
  const auto owner = kFirstOwner + static_cast<std::uint32_t>(fault % kOwners) * 64U +
                     static_cast<std::uint32_t>(config.id);
  drives_.push_back(
      {fault, owner, f_pwm_Hz, ticks_until(now, f_pwm_Hz), std::move(motor), std::move(servo)});
}

std::size_t Duplicates::remove(std::size_t fault, Wire& wire, SimTime now) {
  std::size_t lost = 0;
  std::erase_if(drives_, [&](const Drive& drive) {
    if (drive.fault != fault) return false;
    lost += wire.forget_replies(drive.owner, now);
    return true;
  });
  return lost;
}

void Duplicates::advance_to(SimTime t) {
  for (Drive& drive : drives_) {
    const std::int64_t tick = ticks_until(t, drive.f_pwm_Hz) - drive.first_tick;
    drive.motor.advance(std::max<std::int64_t>(tick - drive.motor.ticks(), 0));
  }
}

std::size_t Duplicates::hear(SimTime at, const protocol::Frame& frame, Wire& wire,
                             FaultBoard& faults, SimTime now) {
  std::size_t answers = 0;
  for (Drive& drive : drives_) {
    Servo& servo = drive.servo;
    const auto addressed = protocol::address(frame);
    const int* const id = std::get_if<int>(&addressed);
    const bool for_several = id != nullptr && *id == protocol::kMultiDrive;
    if (id == nullptr || (!for_several && servo.address() != *id) || !servo.on_its_bus() ||
        !servo.at_its_rate() || servo.multi_drive_mode() != for_several ||
        wire.drive_queue_full(drive.owner) || wire.is_deaf(drive.owner, at)) {
      continue;
    }
    const auto understood = servo.understand(frame);
    const auto* const query = std::get_if<protocol::Query>(&understood);
    // 0x18 would need timing: a duplicate does not calibrate.
    if (query == nullptr || std::holds_alternative<protocol::Calibrate>(query->command)) continue;
    const std::uint64_t writes_before = servo.stats().rom_writes;
    const protocol::Reply reply = servo.handle(*query, Lane{drive.motor, 0});
    if (servo.take_restart()) {
      wire.forget_replies(drive.owner, now);
      servo.power_cycle(Lane{drive.motor, 0});
    }
    if (std::holds_alternative<protocol::NoReply>(reply)) continue;
    const protocol::Frame answer = servo.encode(reply);
    const bool takes_time = wire.bitrate() > 0 || wire.serial() != nullptr;
    SimTime ready = takes_time ? at + servo.reply_time() + kDuplicateLag : at;
    if (servo.stats().rom_writes != writes_before) {
      ready = std::max(ready, at + servo.config().flash.write_time);  // a duplicate has no Memory
    }
    drive.last_reply = std::max(ready, drive.last_reply);
    faults[drive.fault].took_effect(now, servo.id(), &answer);
    wire.send_from_drive(drive.last_reply, answer, 0, drive.owner, false);
    servo.take_move();
    ++answers;
  }
  return answers;
}

int& Duplicates::errors(std::uint32_t owner) {
  return std::ranges::find(drives_, owner, &Drive::owner)->errors;
}

}  // namespace lk::emulator
