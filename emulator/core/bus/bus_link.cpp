// Faults of the link: what a drive hears, what it says, and a second drive that does both.

#include <algorithm>
#include <utility>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/units.hpp"
#include "emulator/core/wire_timing.hpp"

namespace lk::emulator {

// --- what a drive hears
// ------------------------------------------------------------------------------------

bool Bus::hears(std::size_t index, protocol::Frame& frame) {
  if (nodes_[index].link.bus_off) {
    return false;
  }
  if (active_faults_ == 0) {
    return true;
  }
  const Servo& servo = nodes_[index].servo;
  const int id = servo.id();
  // What the drive would not have answered anyway cannot be lost.
  const bool for_several = protocol::find_multi_drive(frame.id) != nullptr;
  const bool listens = servo.multi_drive_mode() == for_several;
  const auto would_answer = [&servo, &frame, listens] {
    return listens && std::holds_alternative<protocol::Query>(servo.understand(frame));
  };
  bool hangs = false;
  for (LiveFault& live : faults_) {
    if (!live.active() || !live.is_of(id)) {
      continue;
    }
    if (live.fault.kind == FaultKind::kHang && would_answer()) {
      took_effect(live, id, &frame);
      hangs = true;
    } else if (live.fault.kind == FaultKind::kDrop && acts_on(live, 0, FrameChoice::kQueries)) {
      if (would_answer() && live.hits()) {
        took_effect(live, id, &frame);
        return false;
      }
    } else if (live.fault.kind == FaultKind::kCorrupt && acts_on(live, 1, FrameChoice::kQueries)) {
      if (listens && live.hits()) {
        flip_bits(live, static_cast<int>(live.value(0)), frame);
        took_effect(live, id, &frame);
      }
    }
  }
  return !hangs;
}

// --- what a drive says
// -------------------------------------------------------------------------------------

void Bus::say(std::size_t index, SimTime ready, const protocol::Frame& frame,
              std::uint64_t rom_write) {
  DriveLink& link = nodes_[index].link;
  const Outgoing said{ready, frame, rom_write};
  if (active_faults_ == 0) {
    link.last_said = said;
    put_on_wire(index, said);
    return;
  }
  std::vector<Outgoing> out{said};
  bool stale = false;
  for (LiveFault& live : faults_) {
    if (live.active() && live.is_of(nodes_[index].servo.id())) {
      stale = corrupt_replies(live, index, out) || stale;
    }
  }
  if (!stale) {
    link.last_said = said;
  }
  std::optional<Outgoing> behind = std::exchange(link.held_back, std::nullopt);
  for (const Outgoing& one : out) {
    if (one.held_back) {
      link.held_back = one;
      continue;
    }
    put_on_wire(index, one);
    if (behind) {
      put_on_wire(index, *std::exchange(behind, std::nullopt));
    }
  }
  if (behind) {
    link.held_back = behind;  // nothing has left that it could follow
  }
}

/// What one fault makes of what a drive is about to say. Returns true when that is what it said
/// before.
bool Bus::corrupt_replies(LiveFault& live, std::size_t index, std::vector<Outgoing>& out) {
  const int id = nodes_[index].servo.id();
  DriveLink& link = nodes_[index].link;
  const auto lose_if = [&](const auto& lost) {
    stats_.replies_lost += std::erase_if(out, [&](const Outgoing& one) {
      if (!lost()) return false;
      took_effect(live, id, &one.frame);
      return true;
    });
  };
  const auto change = [&](const auto& changed) {
    bool any = false;
    for (Outgoing& one : out) {
      if (!live.hits()) continue;
      const protocol::Frame before = one.frame;
      changed(one);
      any = true;
      if (!(one.frame == before)) took_effect(live, id, &one.frame);
    }
    return any;
  };
  const FaultKind kind = live.fault.kind;
  if (kind == FaultKind::kDrop && acts_on(live, 0, FrameChoice::kReplies)) {
    lose_if([&] { return live.hits(); });
  } else if (kind == FaultKind::kSilent) {
    lose_if([] { return true; });
  } else if (kind == FaultKind::kDelay) {
    delay_words(live, index, out);
  } else if (kind == FaultKind::kDuplicate) {
    copy_words(live, index, out);
  } else if (kind == FaultKind::kReorder) {
    hold_back_words(live, index, out);
  } else if (kind == FaultKind::kCorrupt && acts_on(live, 1, FrameChoice::kReplies)) {
    change([&](Outgoing& one) { flip_bits(live, static_cast<int>(live.value(0)), one.frame); });
  } else if (kind == FaultKind::kStale && link.last_said) {
    return change([&](Outgoing& one) {
      one.frame = link.last_said->frame;
      one.after_rom_write = link.last_said->after_rom_write;
    });
  } else if (kind == FaultKind::kWrongDlc) {
    change([&](Outgoing& one) {
      one.frame.dlc = static_cast<std::uint8_t>(live.value(0));
      std::fill(one.frame.data.begin() + one.frame.dlc, one.frame.data.end(), std::uint8_t{0});
    });
  } else if (kind == FaultKind::kWrongId) {
    change([&](Outgoing& one) {
      const int offset = static_cast<int>(live.value(0));
      one.frame.id = (one.frame.id + static_cast<std::uint32_t>(offset)) & 0x7FFU;
    });
  } else if (kind == FaultKind::kQueueFull) {
    for (const Outgoing& one : out) took_effect(live, id, &one.frame);
  }
  return false;
}

void Bus::delay_words(LiveFault& live, std::size_t index, std::vector<Outgoing>& out) {
  for (Outgoing& one : out) {
    if (!live.hits()) continue;
    const double jitter_ms = live.value(1) > 0 ? live.value(1) * live.draw() : 0;
    const SimTime delay = from_ms(live.value(0) + jitter_ms);
    one.ready += delay;
    if (delay > SimTime{0}) took_effect(live, nodes_[index].servo.id(), &one.frame);
  }
}

/// One at a time. Acknowledgements of ROM writes keep their order: whoever lets them out counts on
/// it.
void Bus::hold_back_words(LiveFault& live, std::size_t index, std::vector<Outgoing>& out) {
  const bool taken = nodes_[index].link.held_back || out.empty() || out.front().held_back;
  if (!taken && out.front().after_rom_write == 0 && live.hits()) {
    out.front().held_back = true;
    took_effect(live, nodes_[index].servo.id(), &out.front().frame);
  }
}

/// Copies follow their originals. More than a queue holds is not kept in the first place.
void Bus::copy_words(LiveFault& live, std::size_t index, std::vector<Outgoing>& out) {
  const auto copies = static_cast<std::size_t>(live.value(0));
  std::vector<Outgoing> all;
  for (Outgoing& one : out) {
    all.push_back(one);
    one.held_back = false;
    if (!live.hits()) continue;
    took_effect(live, nodes_[index].servo.id(), &one.frame);
    stats_.extra_frames += copies;
    all.insert(all.end(), copies, one);
  }
  if (all.size() > CanWire::kDriveQueue) {
    stats_.replies_lost += all.size() - CanWire::kDriveQueue;
    all.resize(CanWire::kDriveQueue);
  }
  out = std::move(all);
}

/// In the order of calls, whatever waits how long. What does not fit is lost.
void Bus::put_on_wire(std::size_t index, const Outgoing& out) {
  if (busy(index)) {
    ++stats_.replies_lost;
    return;
  }
  Timeline& timeline = nodes_[index].timeline;
  timeline.last_reply = std::max(out.ready, timeline.last_reply);
  wire_.send_from_drive(timeline.last_reply, out.frame, out.after_rom_write,
                        nodes_[index].servo.reply_id(), nodes_[index].link.blocked);
}

/// Everything that has not left is gone.
void Bus::forget_words(std::size_t index, SimTime at) {
  DriveLink& link = nodes_[index].link;
  stats_.replies_lost += wire_.forget_replies(nodes_[index].servo.reply_id(), at);
  stats_.replies_lost += link.held_back ? 1U : 0U;
  link.held_back.reset();
  link.last_said.reset();
  nodes_[index].timeline.last_reply = SimTime{0};
}

/// A query came while the queue was full.
void Bus::ignored_for_full_queue(std::size_t index, const protocol::Frame& query) {
  if (LiveFault* const full = active_fault(index, FaultKind::kQueueFull)) {
    took_effect(*full, nodes_[index].servo.id(), &query);
  }
}

void Bus::babble(const Babble& babble) {
  LiveFault& live = faults_[babble.fault];
  const SimTime period = from_ms(live.value(0) * 1e-3);
  agenda_.enter(time_ + period, babble);
  const std::size_t index = babble.index;
  const std::uint32_t owner = nodes_[index].servo.reply_id();
  protocol::Frame frame;
  frame.id = static_cast<std::uint32_t>(live.value(1));
  // One may wait behind the one on the wire: so it has the wire to itself when it is fast enough.
  if (!nodes_[index].timeline.alive || nodes_[index].link.bus_off || busy(index) ||
      wire_.copies(owner, frame) >= 2 || active_fault(index, FaultKind::kSilent) != nullptr) {
    return;
  }
  ++stats_.extra_frames;
  took_effect(live, nodes_[index].servo.id(), &frame);
  wire_.send_from_drive(time_, frame, 0, owner, nodes_[index].link.blocked);
}

// --- a fault begins or ends
// --------------------------------------------------------------------------------

void Bus::begin_link_fault(std::size_t fault_index) {
  const Fault& fault = faults_[fault_index].fault;
  for (const int id : fault.ids) {
    if (fault.kind == FaultKind::kBabbling) {
      agenda_.enter(time_, Babble{fault_index, index_of(id)});
    } else if (fault.kind == FaultKind::kDuplicateId) {
      add_duplicate(fault_index, index_of(id));
    }
  }
}

void Bus::end_link_fault(std::size_t fault_index) {
  agenda_.forget_babble(fault_index);
  std::erase_if(duplicates_, [&](const DuplicateDrive& second) {
    if (second.fault != fault_index) return false;
    stats_.replies_lost += wire_.forget_replies(second.owner, time_);
    return true;
  });
}

/// What lasts as long as some fault of its kind does.
void Bus::pass_on_link_faults(std::size_t index) {
  DriveLink& link = nodes_[index].link;
  LiveFault* const full = active_fault(index, FaultKind::kQueueFull);
  if ((full != nullptr) != link.blocked) {
    link.blocked = full != nullptr;
    if (full == nullptr) {
      wire_.release(nodes_[index].servo.reply_id(), time_);
    } else {
      const std::size_t caught = wire_.block(nodes_[index].servo.reply_id(), time_);
      for (std::size_t n = 0; n < caught; ++n) took_effect(*full, nodes_[index].servo.id());
    }
  }
  if (link.held_back && active_fault(index, FaultKind::kReorder) == nullptr) {
    Outgoing late = *std::exchange(link.held_back, std::nullopt);
    late.ready = std::max(late.ready, time_);
    put_on_wire(index, late);
  }
}

// --- a second drive with the same ID
// ------------------------------------------------------------------------

void Bus::add_duplicate(std::size_t fault, std::size_t index) {
  ServoConfig config = nodes_[index].servo.config();
  // A zero that was written since moves no shaft.
  config.boot_offset = config.boot_offset.value_or(config.rom.encoder_offset);
  config.rom = nodes_[index].servo.rom();
  model::DriveInit init = make_drive(config, seed_);
  init.theta_m += faults_[fault].value(0) * kRadPerDeg;
  init.seed = mix(faults_[fault].random + static_cast<std::uint64_t>(config.id));
  const std::int64_t f_pwm_Hz = banks_[nodes_[index].motor.bank].f_pwm_Hz;
  model::DriveBank motor({&init, 1});
  Servo servo(config, motor.telemetry(0));
  duplicates_.push_back({fault, index, duplicate_owner(fault, config.id), f_pwm_Hz,
                         ticks_until(time_, f_pwm_Hz), std::move(motor), std::move(servo)});
}

void Bus::bring_duplicates_to(SimTime t) {
  for (DuplicateDrive& second : duplicates_) {
    const std::int64_t tick = ticks_until(t, second.f_pwm_Hz) - second.first_tick;
    second.motor.advance(std::max<std::int64_t>(tick - second.motor.ticks(), 0));
  }
}

void Bus::duplicates_hear(SimTime at, const protocol::Frame& frame) {
  for (DuplicateDrive& second : duplicates_) {
    Servo& servo = second.servo;
    const auto addressed = protocol::address(frame);
    const int* const id = std::get_if<int>(&addressed);
    const bool for_several = id != nullptr && *id == protocol::kMultiDrive;
    if (id == nullptr || (!for_several && servo.id() != *id) ||
        servo.multi_drive_mode() != for_several || wire_.drive_queue_full(second.owner)) {
      continue;
    }
    const auto understood = servo.understand(frame);
    if (const auto* query = std::get_if<protocol::Query>(&understood)) {
      answer_as_duplicate(at, second, *query);
    }
  }
}

void Bus::answer_as_duplicate(SimTime at, DuplicateDrive& second, const protocol::Query& query) {
  Servo& servo = second.servo;
  const std::uint64_t writes_before = servo.stats().rom_writes;
  const protocol::Frame frame = servo.encode(servo.handle(query, Lane{second.motor, 0}));
  SimTime ready = bitrate_ > 0 ? at + servo.reply_time() + kDuplicateLag : at;
  if (servo.stats().rom_writes != writes_before) {
    ready = std::max(ready, at + servo.config().flash.write_time);  // kept nowhere else
  }
  ready = second.last_reply = std::max(ready, second.last_reply);
  ++stats_.extra_frames;
  took_effect(faults_[second.fault], servo.id(), &frame);
  wire_.send_from_drive(ready, frame, 0, second.owner, false);
}

}  // namespace lk::emulator
