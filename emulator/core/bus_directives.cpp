#include <algorithm>

#include "emulator/core/bus.hpp"
#include "emulator/core/units.hpp"

namespace lk::emulator {
namespace {

/// A ramp moves the source in steps this long.
constexpr SimTime kRampStep = std::chrono::milliseconds(1);

/// How often a power cycle looks whether the drive is dead.
constexpr SimTime kDeathWatch = std::chrono::milliseconds(1);

double fraction(SimTime part, SimTime whole) {
  return static_cast<double>(part.count()) / static_cast<double>(whole.count());
}

}  // namespace

bool Bus::apply(const Directive& directive) {
  settle();
  if (const auto* set = std::get_if<SetFault>(&directive.what)) {
    if (faults_full()) {
      return false;
    }
    begin_fault(arm(set->fault));
  } else if (const auto* clear = std::get_if<ClearFault>(&directive.what)) {
    clear_faults(clear->which);
  } else {
    std::visit(
        [&](const auto& what) {
          if constexpr (requires { act(std::size_t{}, what); }) act(seat(directive.id), what);
        },
        directive.what);
  }
  return true;
}

void Bus::perform(const Task& task) {
  if (const auto* directive = std::get_if<Directive>(&task)) {
    apply(*directive);
  } else if (const auto* step = std::get_if<SupplyStep>(&task)) {
    step_supply(step->seat);
  } else if (const auto* sag = std::get_if<SagEnd>(&task)) {
    act(sag->seat, SupplyVoltage{*nodes_[sag->seat].timeline.before_sag_V});
  } else if (const auto* written = std::get_if<RomWritten>(&task)) {
    finish_rom_write(written->seat);
  } else if (const auto* begin = std::get_if<FaultBegin>(&task)) {
    begin_fault(begin->fault);
  } else if (const auto* end = std::get_if<FaultEnd>(&task)) {
    end_fault(end->fault);
  } else if (const auto* babbling = std::get_if<Babble>(&task)) {
    babble(*babbling);
  } else if (const auto* off = std::get_if<BusOffEnd>(&task)) {
    nodes_[off->seat].link.bus_off = false;
  } else if (std::holds_alternative<Look>(task)) {
    look();
  } else {
    reconnect(std::get<Reconnect>(task).seat);
  }
}

void Bus::act(std::size_t seat, const PowerOn&) {
  agenda_.forget<Reconnect>(seat);  // what was said last counts
  const Lane motor = lane(seat);
  motor.bank.connect_supply(motor.index, true);
}

void Bus::act(std::size_t seat, const PowerOff&) {
  agenda_.forget<Reconnect>(seat);  // what was said last counts
  const Lane motor = lane(seat);
  motor.bank.connect_supply(motor.index, false);
}

void Bus::act(std::size_t seat, const PowerCycle& cycle) {
  act(seat, PowerOff{});
  agenda_.enter(time_ + cycle.off_for, Reconnect{seat});
}

void Bus::reconnect(std::size_t seat) {
  if (nodes_[seat].timeline.alive) {
    agenda_.enter(time_ + kDeathWatch, Reconnect{seat});
  } else {
    act(seat, PowerOn{});
  }
}

void Bus::act(std::size_t seat, const SupplyVoltage& supply) {
  nodes_[seat].timeline.before_sag_V.reset();
  move_supply(seat, supply.supply_V, supply.ramp);
}

void Bus::act(std::size_t seat, const Sag& sag) {
  Timeline& timeline = nodes_[seat].timeline;
  const double now_V = timeline.ramp ? timeline.ramp->to_V : timeline.supply_V;
  timeline.before_sag_V = timeline.before_sag_V.value_or(now_V);
  move_supply(seat, sag.to_V, SimTime{0});
  agenda_.enter(time_ + sag.duration, SagEnd{seat});
}

/// From now on; whatever the supply was about to do is void.
void Bus::move_supply(std::size_t seat, double to_V, SimTime within) {
  Timeline& timeline = nodes_[seat].timeline;
  agenda_.forget<SupplyStep>(seat);
  agenda_.forget<SagEnd>(seat);
  timeline.ramp = {timeline.supply_V, to_V, time_, time_ + within};
  step_supply(seat);
}

void Bus::step_supply(std::size_t seat) {
  Timeline& timeline = nodes_[seat].timeline;
  const Timeline::Ramp ramp = *timeline.ramp;
  if (time_ >= ramp.end) {
    timeline.supply_V = ramp.to_V;
    timeline.ramp.reset();
  } else {
    const double share = fraction(time_ - ramp.begin, ramp.end - ramp.begin);
    timeline.supply_V = ramp.from_V + share * (ramp.to_V - ramp.from_V);
    agenda_.enter(std::min(time_ + kRampStep, ramp.end), SupplyStep{seat});
  }
  const Lane motor = lane(seat);
  motor.bank.set_supply_voltage(motor.index, timeline.supply_V);
}

void Bus::act(std::size_t seat, const AmbientTemperature& ambient) {
  const Lane motor = lane(seat);
  motor.bank.set_ambient_temperature(motor.index, ambient.ambient_C);
}

void Bus::act(std::size_t seat, const Load& load) {
  const Lane motor = lane(seat);
  motor.bank.set_load(motor.index, load.load);
}

void Bus::act(std::size_t seat, const TurnShaft& turn) {
  const Lane motor = lane(seat);
  motor.bank.turn_shaft(motor.index, turn.turn_deg * kRadPerDeg);
}

void Bus::act(std::size_t seat, const Setting& setting) {
  write_setting(nodes_[seat].servo.id(), setting.parameter, setting.value);
}

bool Bus::write_setting(int id, RomParameter parameter, const Registers& value) {
  settle();
  const std::size_t k = seat(id);
  if (!nodes_[k].timeline.alive || nodes_[k].timeline.writing.size() >= CanWire::kDriveQueue) {
    return false;
  }
  nodes_[k].servo.write_setting(parameter, value, lane(k));
  begin_rom_write(k, time_);
  book_firmware(k);
  return true;
}

SimTime Bus::begin_rom_write(std::size_t seat, SimTime at) {
  const Servo& servo = nodes_[seat].servo;
  std::vector<Timeline::Writing>& writing = nodes_[seat].timeline.writing;
  const SimTime begin = writing.empty() ? at : writing.back().done;
  const SimTime done = begin + servo.config().flash.write_time;
  writing.push_back({done,
                     {servo.stats().rom_writes, servo.id(), servo.rom(), servo.wear()},
                     servo.rom_before(),
                     servo.wear_before()});
  agenda_.enter(done, RomWritten{seat});
  return done;
}

void Bus::finish_rom_write(std::size_t seat) {
  auto& writing = nodes_[seat].timeline.writing;
  rom_writes_.push_back(writing.front().after);
  writing.erase(writing.begin());
}

void Bus::set_load(int id, const model::LoadParams& load) { apply({id, Load{load}}); }
void Bus::set_supply_voltage(int id, double supply_V) {
  apply({id, SupplyVoltage{supply_V, SimTime{0}}});
}
void Bus::set_ambient_temperature(int id, double ambient_C) {
  apply({id, AmbientTemperature{ambient_C}});
}
void Bus::power_cycle(int id) {
  settle();
  const std::size_t k = seat(id);
  if (nodes_[k].timeline.alive) {
    lose_power(k, time_);
    nodes_[k].servo.power_cycle(lane(k));
    book_firmware(k);
  }
}

}  // namespace lk::emulator
