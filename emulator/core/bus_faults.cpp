// Faults and conditions of a bus: when they begin and end, and what shows of them.

#include <algorithm>
#include <cassert>
#include <set>
#include <string_view>
#include <utility>

#include "emulator/core/bus.hpp"
#include "emulator/core/fault_table.hpp"
#include "emulator/core/frame_text.hpp"
#include "emulator/core/physical_faults.hpp"
#include "emulator/core/registers.hpp"

namespace lk::emulator {

using State = FaultEvidence::State;

// --- what is planned
// -----------------------------------------------------------------------------------

bool Bus::plan(const TimedDirective& planned) {
  settle();
  const auto* set = std::get_if<SetFault>(&planned.directive.what);
  if ((set != nullptr && faults_full()) || (planned.when && waiting_.size() >= kMostWaiting)) {
    return false;
  }
  Task task = set != nullptr ? Task(FaultBegin{arm(set->fault)}) : Task(planned.directive);
  const SimTime from = std::max(planned.at, time_);
  if (planned.when) {
    waiting_.push_back({.from = from, .when = *planned.when, .task = std::move(task)});
    look_again_by(from);
  } else {
    agenda_.enter(from, std::move(task));
  }
  return true;
}

bool Bus::holds(Waiting& waiting) const {
  const int id = waiting.when.id;
  if (const auto* command = std::get_if<CommandSeen>(&waiting.when.what)) {
    return waiting.seen >= command->count;
  }
  if (const auto* error = std::get_if<ErrorSet>(&waiting.when.what)) {
    return (telemetry(id).errors & model::bit(error->error)) != 0;
  }
  const auto& reaches = std::get<SignalReaches>(waiting.when.what);
  const double value = reaches.signal->read(view(id));
  const double before = waiting.before.value_or(value);
  waiting.before = value;
  switch (reaches.edge) {
    case Edge::kAbove:
      return value >= reaches.level;
    case Edge::kBelow:
      return value <= reaches.level;
    case Edge::kCrosses:
      return (before < reaches.level) != (value < reaches.level);
  }
  return false;
}

/// A query on the wire: whoever waits for it has its turn before the drive hears it.
void Bus::count_command(int id, const protocol::Frame& frame) {
  if (waiting_.empty()) {
    return;
  }
  bool complete = false;
  for (Waiting& waiting : waiting_) {
    const auto* command = std::get_if<CommandSeen>(&waiting.when.what);
    if (command != nullptr && waiting.when.id == id && waiting.from <= time_ &&
        command->command == frame.data[0]) {
      complete = ++waiting.seen >= command->count || complete;
    }
  }
  if (complete) {
    look();
  }
}

void Bus::look_again_by(SimTime at) {
  if (!next_look_ || *next_look_ > at) {
    next_look_ = at;
    agenda_.enter(at, Look{});
  }
}

void Bus::look() {
  if (next_look_ && *next_look_ <= time_) {
    next_look_.reset();
  }
  std::vector<Task> due;
  for (Waiting& waiting : waiting_) {
    waiting.due = waiting.from <= time_ && holds(waiting);
    if (waiting.due) {
      due.push_back(std::move(waiting.task));
    }
  }
  std::erase_if(waiting_, [](const Waiting& waiting) { return waiting.due; });
  for (const Task& task : due) {
    perform(task);
  }
  look_at_faults();
  if (!waiting_.empty() || active_faults_ > 0) {
    look_again_by(time_ + kLookStep);
  }
}

// --- the life of a fault
// -----------------------------------------------------------------------------------

std::string Bus::free_name(const Fault& fault) const {
  const std::string wanted =
      fault.name.empty() ? std::string(fault_row(fault.kind).word) : fault.name;
  std::string name = wanted;
  std::set<std::string_view> taken;
  for (const LiveFault& live : faults_) taken.insert(live.fault.name);
  for (int n = 2; taken.contains(name); ++n) {
    name = wanted + "-" + std::to_string(n);
  }
  return name;
}

std::size_t Bus::arm(Fault fault) {
  assert(!faults_full());
  assert(std::ranges::all_of(fault.ids, [this](int id) { return has(id); }));
  assert(!fault.every || *fault.every > fault.duration.value_or(SimTime{0}));
  fault.name = free_name(fault);
  LiveFault live;
  live.fault = std::move(fault);
  live.evidence.armed_at = time_;
  live.anchors.resize(live.fault.ids.size());
  live.random = stream_seed(seed_, static_cast<int>(faults_.size()), SeedStream::kFault);
  faults_.push_back(std::move(live));
  return faults_.size() - 1;
}

void Bus::begin_fault(std::size_t fault_index) {
  LiveFault& live = faults_[fault_index];
  const Fault& fault = live.fault;
  if (live.evidence.state == State::kCleared) {
    return;  // by what its condition set off before it
  }
  ++live.beginnings;
  live.since = time_;
  live.evidence.began_at = live.evidence.began_at.value_or(time_);
  if (live.comes_again()) {
    agenda_.enter(time_ + *fault.every, FaultBegin{fault_index});
  }
  if (fault_row(fault.kind).momentary) {
    for (const int id : fault.ids) strike(live, index_of(id));
    live.evidence.state = live.comes_again() ? State::kPaused : State::kOver;
    return;
  }
  live.evidence.state = State::kActive;
  ++active_faults_;
  if (fault.duration) {
    agenda_.enter(time_ + *fault.duration, FaultEnd{fault_index});
  }
  for (std::size_t n = 0; n < fault.ids.size(); ++n) {
    live.anchors[n] = truth(fault.ids[n]).theta_out;
    pass_on_faults(index_of(fault.ids[n]));
  }
  begin_link_fault(fault_index);
  look_again_by(time_ + kLookStep);
}

void Bus::end_fault(std::size_t fault_index) {
  LiveFault& live = faults_[fault_index];
  look_at(live);  // whether its turn has come or not
  look_at_faults();
  live.evidence.state = live.comes_again() ? State::kPaused : State::kOver;
  --active_faults_;
  end_link_fault(fault_index);
  for (const int id : live.fault.ids) {
    pass_on_faults(index_of(id));
  }
}

void Bus::clear_faults(const std::string& which) {
  if (which == kPlanned) {
    agenda_.forget_directives();
    std::erase_if(waiting_, [](const Waiting& waiting) {
      return std::holds_alternative<Directive>(waiting.task);
    });
    return;
  }
  for (std::size_t fault_index = 0; fault_index < faults_.size(); ++fault_index) {
    LiveFault& live = faults_[fault_index];
    const bool meant =
        which == "all" || which == live.fault.name || which == fault_row(live.fault.kind).word;
    const bool done = live.evidence.state == State::kOver || live.evidence.state == State::kCleared;
    if (!meant || done) {
      continue;
    }
    agenda_.forget_fault(fault_index);
    std::erase_if(waiting_, [fault_index](const Waiting& waiting) {
      const auto* begin = std::get_if<FaultBegin>(&waiting.task);
      return begin != nullptr && begin->fault == fault_index;
    });
    if (live.active()) {
      end_fault(fault_index);
    }
    live.evidence.state = State::kCleared;
  }
}

std::vector<FaultReport> Bus::faults() const {
  std::vector<FaultReport> reports;
  reports.reserve(faults_.size());
  for (const LiveFault& live : faults_) {
    reports.push_back({live.fault, live.evidence});
  }
  return reports;
}

std::size_t Bus::unmet_directives() const {
  return static_cast<std::size_t>(std::ranges::count_if(waiting_, [](const Waiting& waiting) {
    return std::holds_alternative<Directive>(waiting.task);
  }));
}

// --- what they do
// -----------------------------------------------------------------------------------

LiveFault* Bus::active_fault(std::size_t index, FaultKind kind) {
  if (active_faults_ == 0) {
    return nullptr;
  }
  const auto found = std::ranges::find_if(faults_, [&](const LiveFault& live) {
    return live.fault.kind == kind && live.active() && live.is_of(nodes_[index].servo.id());
  });
  return found != faults_.end() ? &*found : nullptr;
}

void Bus::pass_on_faults(std::size_t index) {
  const Servo& servo = nodes_[index].servo;
  model::Faults physical;
  FirmwareFaults firmware;
  for (const LiveFault& live : faults_) {
    if (!live.active() || !live.is_of(servo.id())) {
      continue;
    }
    add_physical_fault(live, servo.config(), time_, physical);
    firmware.rom_write_fails |= live.fault.kind == FaultKind::kRomWriteFails;
    firmware.rom_worn |= live.fault.kind == FaultKind::kRomWorn;
    firmware.forgets_broadcast |= live.fault.kind == FaultKind::kForgetsBroadcast;
    firmware.forgets_limits |= live.fault.kind == FaultKind::kForgetsLimits;
  }
  nodes_[index].servo.set_faults(firmware);
  pass_on_link_faults(index);
  const Lane motor = lane(index);
  if (!(motor.bank.faults(motor.index) == physical)) {
    motor.bank.set_faults(motor.index, physical);
  }
}

void Bus::strike(LiveFault& live, std::size_t index) {
  const Lane motor = lane(index);
  Servo& servo = nodes_[index].servo;
  bool struck = false;
  if (live.fault.kind == FaultKind::kKick) {
    const model::Truth before = truth(servo.id());
    motor.bank.kick(motor.index, live.value(0));
    const model::Truth after = truth(servo.id());
    struck = before.omega_m != after.omega_m || before.omega_out != after.omega_out;
  } else if (live.fault.kind == FaultKind::kReset) {
    struck = nodes_[index].timeline.alive;
    power_cycle(servo.id());
  } else if (live.fault.kind == FaultKind::kRamFlipped) {
    live.draw();
    const auto parameter = static_cast<RomParameter>(live.value(0));
    struck = nodes_[index].timeline.alive && servo.flip_ram(parameter, live.random, motor);
  } else {
    assert(live.fault.kind == FaultKind::kRomDamaged);
    const auto parameter = static_cast<std::size_t>(live.value(0));
    for (std::size_t n = 0; n < kRomParameters; ++n) {
      if (parameter == n || parameter == kRomParameters) {
        struck = damage_rom(index, static_cast<RomParameter>(n)) || struck;
      }
    }
  }
  if (struck) {
    took_effect(live, servo.id());
  }
}

/// Whoever keeps the ROM is told like of a write, or by the writes that are under way.
bool Bus::damage_rom(std::size_t index, RomParameter parameter) {
  Servo& servo = nodes_[index].servo;
  if (!servo.damage_rom(parameter)) {
    return false;
  }
  std::vector<Timeline::Writing>& writing = nodes_[index].timeline.writing;
  for (Timeline::Writing& one : writing) {
    copy_parameter(parameter, servo.rom(), one.rom_before);
    copy_parameter(parameter, servo.rom(), one.after.rom);
  }
  if (writing.empty()) {
    rom_writes_.push_back({servo.stats().rom_writes, servo.id(), servo.rom(), servo.wear()});
  }
  return true;
}

/// What is new at once, and of the others as many as one step is to take, in turns.
void Bus::look_at_faults() {
  for (LiveFault& live : faults_) {
    if (live.looked_at < live.since) {
      look_at(live);
    }
  }
  std::size_t looks = 0;
  for (std::size_t n = 0; n < faults_.size() && looks < kMostLooks; ++n) {
    looks += look_at(faults_[fault_turn_]);
    fault_turn_ = (fault_turn_ + 1) % faults_.size();
  }
  if (looks < kMostLooks) {
    fault_turn_ = 0;
  }
  for (const std::size_t k : std::exchange(moved_, {})) {
    pass_on_faults(k);
  }
}

/// A physical fault that lasts, at one instant: what moves is noted, what shows is counted.
/// Returns at how many drives there was something to look at.
std::size_t Bus::look_at(LiveFault& live) {
  if (!live.active() || !is_physical(live.fault.kind) || live.looked_at == time_) {
    return 0;
  }
  live.looked_at = time_;
  const bool moves =
      live.fault.kind == FaultKind::kEncoderDrift || live.fault.kind == FaultKind::kRebootLoop;
  for (const int id : live.fault.ids) {
    const std::size_t k = index_of(id);
    const Lane motor = lane(k);
    model::Faults alone;
    add_physical_fault(live, nodes_[k].servo.config(), time_, alone);
    if (motor.bank.takes_effect(motor.index, alone)) {
      took_effect(live, id);
    }
    if (moves) {
      moved_.insert(k);
    }
  }
  return live.fault.ids.size();
}

void Bus::book_firmware(std::size_t index) {
  if (active_faults_ == 0) {
    return;
  }
  const FirmwareFaults shown = nodes_[index].servo.take_shown_faults();
  const int id = nodes_[index].servo.id();
  const auto book = [&](bool happened, FaultKind kind) {
    if (!happened) return;
    for (LiveFault& live : faults_) {
      if (live.fault.kind == kind && live.active() && live.is_of(id)) took_effect(live, id);
    }
  };
  book(shown.rom_write_fails, FaultKind::kRomWriteFails);
  book(shown.rom_worn, FaultKind::kRomWorn);
  book(shown.forgets_broadcast, FaultKind::kForgetsBroadcast);
  book(shown.forgets_limits, FaultKind::kForgetsLimits);
}

void Bus::took_effect(LiveFault& live, int id, const protocol::Frame* frame) {
  FaultEvidence& evidence = live.evidence;
  if (evidence.effects++ > 0) {
    return;
  }
  evidence.first_effect_at = time_;
  if (id != kWholeBus) {
    evidence.first_on = "drive " + std::to_string(id);
  }
  if (frame != nullptr) {
    evidence.first_on += (evidence.first_on.empty() ? "" : ", ") + frame_text(*frame);
  }
}

}  // namespace lk::emulator
