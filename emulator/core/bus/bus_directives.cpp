// Actions on a bus besides sending frames: at once, at a time, or on a condition.

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/faults/acts.hpp"
#include "emulator/core/faults/make_fault.hpp"
#include "emulator/core/overloaded.hpp"
#include "emulator/core/units.hpp"

namespace lk::emulator {

/// Interval at which a power cycle checks whether the drive is dead.
constexpr SimTime kPowerOffPollPeriod = std::chrono::milliseconds(1);

void Bus::check(const Directive& directive) const {
  std::visit(overloaded{
                 [&](const SetFault& set) {
                   const std::string problem = fault_problem(set.fault);
                   if (!problem.empty()) throw std::invalid_argument(problem);
                   for (const int id : set.fault.ids) nodes_.of(id);
                 },
                 [](const ClearFault&) {},
                 [](const BodyAct&) {},
                 [](const Mark&) {},
                 [&](const auto&) { nodes_.of(directive.id); },
             },
             directive.what);
}

bool Bus::apply(const Directive& directive) {
  check(directive);
  settle();
  const int id = directive.id;
  const auto motor = [&] { return lane(nodes_.of(id)); };
  const auto connect = [&](bool connected) {
    agenda_.cancel<Reconnect>(id);  // the last request wins
    motor().bank.connect_supply(motor().index, connected);
  };
  // A new supply request cancels the pending one.
  const auto start_supply = [&] {
    agenda_.cancel<SupplyStep>(id);
    agenda_.cancel<SagEnd>(id);
    step_supply(nodes_.of(id));
  };
  bool done = true;
  std::visit(
      overloaded{
          [&](const PowerOn&) { connect(true); }, [&](const PowerOff&) { connect(false); },
          [&](const PowerCycle& cycle) {
            connect(false);
            agenda_.schedule(time_ + cycle.off_for, Reconnect{id});
          },
          [&](const SupplyVoltage& supply) {
            nodes_.of(id).power.move(supply.supply_V, time_, supply.ramp);
            start_supply();
          },
          [&](const Sag& sag) {
            nodes_.of(id).power.sag(sag.to_V, time_);
            start_supply();
            agenda_.schedule(time_ + sag.duration, SagEnd{id});
          },
          [&](const AmbientTemperature& ambient) {
            motor().bank.set_ambient_temperature(motor().index, ambient.ambient_C);
          },
          [&](const Load& load) { motor().bank.set_load(motor().index, load.load); },
          [&](const TurnShaft& turn) {
            motor().bank.turn_shaft(motor().index, turn.turn_deg * kRadPerDeg);
          },
          [&](const Setting& setting) { write_setting(id, setting.parameter, setting.value); },
          [&](const SetFault& set) {
            done = !faults_.full();
            if (done) begin_fault(faults_.arm(set.fault, time_));
          },
          [&](const ClearFault& clear) {
            if (clear.which == kPlanned) {
              agenda_.cancel_directives();
              conditions_.cancel_directives();
              return;
            }
            for (const std::size_t fault : faults_.find(clear.which)) {
              agenda_.cancel_fault<FaultBegin>(fault);
              agenda_.cancel_fault<FaultEnd>(fault);
              conditions_.cancel_fault(fault);
              if (faults_[fault].active()) end_fault(fault);
              faults_[fault].evidence.state = FaultEvidence::State::kCleared;
            }
          },
          [&](const BodyAct& act) { body_acts_.push_back(act); },
          [](const Mark&) {},  // only noted in logs and recordings
      },
      directive.what);
  return done;
}

bool Bus::plan(const TimedDirective& planned) {
  settle();
  return schedule(planned, Agenda::Rank::kRuntime);
}

bool Bus::plan_as_configured(const TimedDirective& event) {
  settle();
  return schedule(event, Agenda::Rank::kConfigured);
}

bool Bus::schedule(const TimedDirective& planned, Agenda::Rank rank) {
  check(planned.directive);
  if (planned.when) nodes_.of(planned.when->id);
  const SimTime armed_at = rank == Agenda::Rank::kConfigured ? SimTime{0} : time_;
  const auto* set = std::get_if<SetFault>(&planned.directive.what);
  if ((set != nullptr && faults_.full()) || (planned.when && conditions_.full())) return false;
  Task task = planned.directive;
  if (set != nullptr) {
    task = FaultBegin{faults_.arm(set->fault, armed_at)};
  }
  const SimTime from = std::max(planned.at, time_);
  if (planned.when) {
    conditions_.add(from, *planned.when, std::move(task));
    agenda_.sample_by(from, rank);
  } else {
    agenda_.schedule(from, std::move(task), rank);
  }
  return true;
}

void Bus::perform(const Task& task) {
  std::visit(overloaded{
                 [&](const Directive& directive) { apply(directive); },
                 [&](const SupplyStep& step) { step_supply(nodes_.of(step.id)); },
                 [&](const SagEnd& sag) {
                   const double supply_V = nodes_.of(sag.id).power.after_sag_V();
                   apply({sag.id, SupplyVoltage{supply_V, SimTime{0}}});
                 },
                 [&](const RomWritten& written) {
                   rom_writes_.push_back(nodes_.of(written.id).memory.finish());
                 },
                 [&](const CalibrationStep& step) { step_calibration(nodes_.of(step.id)); },
                 [&](const Reconnect& reconnect) {
                   if (nodes_.of(reconnect.id).power.alive) {
                     agenda_.schedule(time_ + kPowerOffPollPeriod, reconnect);
                   } else {
                     apply({reconnect.id, PowerOn{}});
                   }
                 },
                 [&](const BusOffEnd& off) { nodes_.of(off.id).link.bus_off = false; },
                 [&](const FaultBegin& begin) { begin_fault(begin.fault); },
                 [&](const FaultEnd& end) { end_fault(end.fault); },
                 [&](const Babbling& babbling) {
                   LiveFault& live = faults_[babbling.fault];
                   Node& node = nodes_.of(babbling.id);
                   OnBabble on{live, node.servo, node.link, time_ - node.started};
                   Babble next = live.row().babble(on);
                   if (serial_ && next.frame) {
                     next.frame->kind = protocol::FrameKind::kBytes, next.frame->id = 0;
                   }
                   agenda_.schedule(time_ + next.pause, babbling);
                   const bool silent = faults_.first(node.id(), &FaultRow::silences) != nullptr;
                   if (!next.frame || !node.power.alive || silent ||
                       !node.link.babble(wire_, *next.frame, time_)) {
                     return;
                   }
                   ++stats_.extra_frames;
                   live.took_effect(time_, node.id(), &*next.frame);
                 },
                 [&](const Sample&) { sample(); },
             },
             task);
}

void Bus::step_supply(Node& node) {
  if (const auto next = node.power.step(time_)) agenda_.schedule(*next, SupplyStep{node.id()});
  const Lane motor = lane(node);
  motor.bank.set_supply_voltage(motor.index, node.power.supply_V());
}

void Bus::sample() {
  agenda_.clear_due_sample(time_);
  const std::vector<Task> due = conditions_.take_due(time_, [this](int id) { return view(id); });
  for (const Task& task : due) perform(task);
  sample_faults();
  if (faults_or_conditions()) agenda_.sample_by(time_ + kSamplePeriod);
}

bool Bus::write_setting(int id, RomParameter parameter, const Registers& value) {
  settle();
  Node& node = nodes_.of(id);
  if (!node.power.alive || node.memory.size() >= Wire::kDriveQueue) return false;
  const DriveAddress address = node.servo.bus_address;
  emulator::write_setting(node.servo, parameter, value, lane(node));
  if (node.servo.bus_address != address) on_address_change(node);
  agenda_.schedule(node.memory.begin(time_, node.servo), RomWritten{id});
  faults_.count_firmware_effects(node.servo, time_);
  return true;
}

void Bus::set_load(int id, const model::LoadParams& load) { apply({id, Load{load}}); }
void Bus::set_supply_voltage(int id, double supply_V) {
  apply({id, SupplyVoltage{supply_V, SimTime{0}}});
}
void Bus::set_ambient_temperature(int id, double ambient_C) {
  apply({id, AmbientTemperature{ambient_C}});
}

}  // namespace lk::emulator
