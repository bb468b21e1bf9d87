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

namespace {

/// Throws std::invalid_argument if the fault is impossible, std::out_of_range if a drive is not on
/// the bus.
void check(const BusState& bus, const Directive& directive) {
  std::visit(overloaded{
                 [&](const SetFault& set) {
                   const std::string problem = fault_problem(set.fault);
                   if (!problem.empty()) throw std::invalid_argument(problem);
                   for (const int id : set.fault.ids) bus.nodes.of(id);
                 },
                 [](const ClearFault&) {},
                 [](const BodyAct&) {},
                 [](const Mark&) {},
                 [&](const auto&) { bus.nodes.of(directive.id); },
             },
             directive.what);
}

void step_supply(BusState& bus, Node& node) {
  if (const auto next = node.power.step(bus.time))
    bus.agenda.schedule(*next, SupplyStep{node.id()});
  const Lane motor = bus.lane(node);
  motor.bank.set_supply_voltage(motor.index, node.power.supply_V());
}

bool schedule(BusState& bus, const TimedDirective& planned, Agenda::Rank rank) {
  check(bus, planned.directive);
  if (planned.when) bus.nodes.of(planned.when->id);
  const SimTime armed_at = rank == Agenda::Rank::kConfigured ? SimTime{0} : bus.time;
  const auto* set = std::get_if<SetFault>(&planned.directive.what);
  if ((set != nullptr && bus.faults.full()) || (planned.when && bus.conditions.full()))
    return false;
  Task task = planned.directive;
  if (set != nullptr) {
    task = FaultBegin{bus.faults.arm(set->fault, armed_at)};
  }
  const SimTime from = std::max(planned.at, bus.time);
  if (planned.when) {
    bus.conditions.add(from, *planned.when, std::move(task));
    bus.agenda.sample_by(from, rank);
  } else {
    bus.agenda.schedule(from, std::move(task), rank);
  }
  return true;
}

}  // namespace

/// Interval at which a power cycle checks whether the drive is dead.
constexpr SimTime kPowerOffPollPeriod = std::chrono::milliseconds(1);

bool apply(BusState& bus, const Directive& directive) {
  check(bus, directive);
  settle(bus);
  const int id = directive.id;
  const auto motor = [&] { return bus.lane(bus.nodes.of(id)); };
  const auto connect = [&](bool connected) {
    bus.agenda.cancel<Reconnect>(id);  // the last request wins
    motor().bank.connect_supply(motor().index, connected);
  };
  // Cancels the pending steps of the earlier supply directive and takes the first step of the new.
  const auto start_supply = [&] {
    bus.agenda.cancel<SupplyStep>(id);
    bus.agenda.cancel<SagEnd>(id);
    step_supply(bus, bus.nodes.of(id));
  };
  bool done = true;
  std::visit(
      overloaded{
          [&](const PowerOn&) { connect(true); }, [&](const PowerOff&) { connect(false); },
          [&](const PowerCycle& cycle) {
            connect(false);
            bus.agenda.schedule(bus.time + cycle.off_for, Reconnect{id});
          },
          [&](const SupplyVoltage& supply) {
            bus.nodes.of(id).power.move(supply.supply_V, bus.time, supply.ramp);
            start_supply();
          },
          [&](const Sag& sag) {
            bus.nodes.of(id).power.sag(sag.to_V, bus.time);
            start_supply();
            bus.agenda.schedule(bus.time + sag.duration, SagEnd{id});
          },
          [&](const AmbientTemperature& ambient) {
            motor().bank.set_ambient_temperature(motor().index, ambient.ambient_C);
          },
          [&](const Load& load) { motor().bank.set_load(motor().index, load.load); },
          [&](const TurnShaft& turn) {
            motor().bank.turn_shaft(motor().index, turn.turn_deg * kRadPerDeg);
          },
          [&](const Setting& setting) { write_setting(bus, id, setting.parameter, setting.value); },
          [&](const SetFault& set) {
            done = !bus.faults.full();
            if (done) begin_fault(bus, bus.faults.arm(set.fault, bus.time));
          },
          [&](const ClearFault& clear) {
            if (clear.which == kPlanned) {
              bus.agenda.cancel_directives();
              bus.conditions.cancel_directives();
              return;
            }
            for (const std::size_t fault : bus.faults.find(clear.which)) {
              bus.agenda.cancel_fault<FaultBegin>(fault);
              bus.agenda.cancel_fault<FaultEnd>(fault);
              bus.conditions.cancel_fault(fault);
              if (bus.faults[fault].active()) end_fault(bus, fault);
              bus.faults[fault].evidence.state = FaultEvidence::State::kCleared;
            }
          },
          [&](const BodyAct& act) { bus.body_acts.push_back(act); },
          [](const Mark&) {},  // only noted in logs and recordings
      },
      directive.what);
  return done;
}

bool plan(BusState& bus, const TimedDirective& planned) {
  settle(bus);
  return schedule(bus, planned, Agenda::Rank::kRuntime);
}

bool plan_as_configured(BusState& bus, const TimedDirective& event) {
  settle(bus);
  return schedule(bus, event, Agenda::Rank::kConfigured);
}

void perform(BusState& bus, const Task& task) {
  std::visit(overloaded{
                 [&](const Directive& directive) { apply(bus, directive); },
                 [&](const SupplyStep& step) { step_supply(bus, bus.nodes.of(step.id)); },
                 [&](const SagEnd& sag) {
                   const double supply_V = bus.nodes.of(sag.id).power.after_sag_V();
                   apply(bus, {sag.id, SupplyVoltage{supply_V, SimTime{0}}});
                 },
                 [&](const RomWritten& written) {
                   bus.rom_writes.push_back(bus.nodes.of(written.id).memory.finish());
                 },
                 [&](const CalibrationStep& step) { step_calibration(bus, bus.nodes.of(step.id)); },
                 [&](const Reconnect& reconnect) {
                   if (bus.nodes.of(reconnect.id).power.alive) {
                     bus.agenda.schedule(bus.time + kPowerOffPollPeriod, reconnect);
                   } else {
                     apply(bus, {reconnect.id, PowerOn{}});
                   }
                 },
                 [&](const BusOffEnd& off) { bus.nodes.of(off.id).link.bus_off = false; },
                 [&](const UnaskedStep& step) {
                   Node& node = bus.nodes.of(step.id);
                   node.unasked.step(bus.time, node.servo, bus.lane(node));
                   schedule_unasked(bus, node);
                 },
                 [&](const FaultBegin& begin) { begin_fault(bus, begin.fault); },
                 [&](const FaultEnd& end) { end_fault(bus, end.fault); },
                 [&](const Babbling& babbling) {
                   LiveFault& live = bus.faults[babbling.fault];
                   Node& node = bus.nodes.of(babbling.id);
                   OnBabble on{live, node.servo, node.link, bus.time - node.started};
                   Babble next = live.row().babble(on);
                   if (bus.serial && next.frame) {
                     next.frame->kind = protocol::FrameKind::kBytes, next.frame->id = 0;
                   }
                   bus.agenda.schedule(bus.time + next.pause, babbling);
                   const bool silent = bus.faults.first(node.id(), &FaultRow::silences) != nullptr;
                   if (!next.frame || !node.power.alive || silent ||
                       !node.link.babble(bus.wire, *next.frame, bus.time)) {
                     return;
                   }
                   ++bus.own_stats.extra_frames;
                   live.took_effect(bus.time, node.id(), &*next.frame);
                 },
                 [&](const Sample&) { sample(bus); },
             },
             task);
}

void sample(BusState& bus) {
  bus.agenda.clear_due_sample(bus.time);
  const std::vector<Task> due =
      bus.conditions.take_due(bus.time, [&bus](int id) { return bus.view(id); });
  for (const Task& task : due) perform(bus, task);
  sample_faults(bus);
  if (bus.faults_or_conditions()) bus.agenda.sample_by(bus.time + kSamplePeriod);
}

bool write_setting(BusState& bus, int id, RomParameter parameter, const Registers& value) {
  settle(bus);
  Node& node = bus.nodes.of(id);
  if (!node.power.alive || node.memory.size() >= Wire::kDriveQueue) return false;
  const DriveAddress address = node.servo.bus_address;
  write_setting(node.servo, parameter, value, bus.lane(node));
  if (node.servo.bus_address != address) on_address_change(bus, node);
  bus.agenda.schedule(node.memory.begin(bus.time, node.servo), RomWritten{id});
  count_firmware_effects(bus.faults, node.servo, bus.time);
  return true;
}

}  // namespace lk::emulator
