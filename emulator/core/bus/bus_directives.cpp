#include <algorithm>

#include "emulator/core/bus/bus.hpp"
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
          if constexpr (requires { act(std::size_t{}, what); }) act(index_of(directive.id), what);
        },
        directive.what);
  }
  return true;
}

void Bus::perform(const Task& task) {
  if (const auto* directive = std::get_if<Directive>(&task)) {
    apply(*directive);
  } else if (const auto* step = std::get_if<SupplyStep>(&task)) {
    step_supply(step->index);
  } else if (const auto* sag = std::get_if<SagEnd>(&task)) {
    act(sag->index, SupplyVoltage{*nodes_[sag->index].timeline.before_sag_V});
  } else if (const auto* written = std::get_if<RomWritten>(&task)) {
    finish_rom_write(written->index);
  } else if (const auto* begin = std::get_if<FaultBegin>(&task)) {
    begin_fault(begin->fault);
  } else if (const auto* end = std::get_if<FaultEnd>(&task)) {
    end_fault(end->fault);
  } else if (const auto* babbling = std::get_if<Babble>(&task)) {
    babble(*babbling);
  } else if (const auto* off = std::get_if<BusOffEnd>(&task)) {
    nodes_[off->index].link.bus_off = false;
  } else if (std::holds_alternative<Look>(task)) {
    look();
  } else {
    reconnect(std::get<Reconnect>(task).index);
  }
}

void Bus::act(std::size_t index, const PowerOn&) {
  agenda_.forget<Reconnect>(index);  // what was said last counts
  const Lane motor = lane(index);
  motor.bank.connect_supply(motor.index, true);
}

void Bus::act(std::size_t index, const PowerOff&) {
  agenda_.forget<Reconnect>(index);  // what was said last counts
  const Lane motor = lane(index);
  motor.bank.connect_supply(motor.index, false);
}

void Bus::act(std::size_t index, const PowerCycle& cycle) {
  act(index, PowerOff{});
  agenda_.enter(time_ + cycle.off_for, Reconnect{index});
}

void Bus::reconnect(std::size_t index) {
  if (nodes_[index].timeline.alive) {
    agenda_.enter(time_ + kDeathWatch, Reconnect{index});
  } else {
    act(index, PowerOn{});
  }
}

void Bus::act(std::size_t index, const SupplyVoltage& supply) {
  nodes_[index].timeline.before_sag_V.reset();
  move_supply(index, supply.supply_V, supply.ramp);
}

void Bus::act(std::size_t index, const Sag& sag) {
  Timeline& timeline = nodes_[index].timeline;
  const double now_V = timeline.ramp ? timeline.ramp->to_V : timeline.supply_V;
  timeline.before_sag_V = timeline.before_sag_V.value_or(now_V);
  move_supply(index, sag.to_V, SimTime{0});
  agenda_.enter(time_ + sag.duration, SagEnd{index});
}

/// From now on; whatever the supply was about to do is void.
void Bus::move_supply(std::size_t index, double to_V, SimTime within) {
  Timeline& timeline = nodes_[index].timeline;
  agenda_.forget<SupplyStep>(index);
  agenda_.forget<SagEnd>(index);
  timeline.ramp = {timeline.supply_V, to_V, time_, time_ + within};
  step_supply(index);
}

void Bus::step_supply(std::size_t index) {
  Timeline& timeline = nodes_[index].timeline;
  const Timeline::Ramp ramp = *timeline.ramp;
  if (time_ >= ramp.end) {
    timeline.supply_V = ramp.to_V;
    timeline.ramp.reset();
  } else {
    const double share = fraction(time_ - ramp.begin, ramp.end - ramp.begin);
    timeline.supply_V = ramp.from_V + share * (ramp.to_V - ramp.from_V);
    agenda_.enter(std::min(time_ + kRampStep, ramp.end), SupplyStep{index});
  }
  const Lane motor = lane(index);
  motor.bank.set_supply_voltage(motor.index, timeline.supply_V);
}

void Bus::act(std::size_t index, const AmbientTemperature& ambient) {
  const Lane motor = lane(index);
  motor.bank.set_ambient_temperature(motor.index, ambient.ambient_C);
}

void Bus::act(std::size_t index, const Load& load) {
  const Lane motor = lane(index);
  motor.bank.set_load(motor.index, load.load);
}

void Bus::act(std::size_t index, const TurnShaft& turn) {
  const Lane motor = lane(index);
  motor.bank.turn_shaft(motor.index, turn.turn_deg * kRadPerDeg);
}

void Bus::act(std::size_t index, const Setting& setting) {
  write_setting(nodes_[index].servo.id(), setting.parameter, setting.value);
}

bool Bus::write_setting(int id, RomParameter parameter, const Registers& value) {
  settle();
  const std::size_t k = index_of(id);
  if (!nodes_[k].timeline.alive || nodes_[k].timeline.writing.size() >= CanWire::kDriveQueue) {
    return false;
  }
  nodes_[k].servo.write_setting(parameter, value, lane(k));
  begin_rom_write(k, time_);
  book_firmware(k);
  return true;
}

SimTime Bus::begin_rom_write(std::size_t index, SimTime at) {
  const Servo& servo = nodes_[index].servo;
  std::vector<Timeline::Writing>& writing = nodes_[index].timeline.writing;
  const SimTime begin = writing.empty() ? at : writing.back().done;
  const SimTime done = begin + servo.config().flash.write_time;
  writing.push_back({done,
                     {servo.stats().rom_writes, servo.id(), servo.rom(), servo.wear()},
                     servo.rom_before(),
                     servo.wear_before()});
  agenda_.enter(done, RomWritten{index});
  return done;
}

void Bus::finish_rom_write(std::size_t index) {
  auto& writing = nodes_[index].timeline.writing;
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
  const std::size_t k = index_of(id);
  if (nodes_[k].timeline.alive) {
    lose_power(k, time_);
    nodes_[k].servo.power_cycle(lane(k));
    book_firmware(k);
  }
}

}  // namespace lk::emulator
