#include "emulator/core/bus/conditions.hpp"

#include <algorithm>
#include <utility>

#include "emulator/core/overloaded.hpp"

namespace lk::emulator {

void Conditions::add(SimTime from, const Condition& when, Task task) {
  waiting_.push_back({.from = from, .when = when, .task = std::move(task)});
}

bool Conditions::count(int id, std::uint8_t command, SimTime now) {
  bool complete = false;
  for (Waiting& waiting : waiting_) {
    const auto* seen = std::get_if<CommandSeen>(&waiting.when.what);
    if (seen != nullptr && waiting.when.id == id && waiting.from <= now &&
        seen->command == command) {
      complete = ++waiting.seen >= seen->count || complete;
    }
  }
  return complete;
}

/// Returns true if the condition holds. Stores the sampled value of a signal in `waiting`.
bool Conditions::holds(Waiting& waiting, const std::function<DriveView(int id)>& view) {
  const auto passes = [&](const SignalReaches& reaches) {
    const double value = reaches.signal->read(view(waiting.when.id));
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
  };
  return std::visit(
      overloaded{[&](const CommandSeen& command) { return waiting.seen >= command.count; },
                 [&](const ErrorSet& error) {
                   const model::Telemetry telemetry = view(waiting.when.id).telemetry;
                   return (telemetry.errors & model::bit(error.error)) != 0;
                 },
                 passes},
      waiting.when.what);
}

std::vector<Task> Conditions::take_due(SimTime now, const std::function<DriveView(int id)>& view) {
  std::vector<Task> due;
  for (Waiting& waiting : waiting_) {
    waiting.due = waiting.from <= now && holds(waiting, view);
    if (waiting.due) due.push_back(std::move(waiting.task));
  }
  std::erase_if(waiting_, [](const Waiting& waiting) { return waiting.due; });
  return due;
}

void Conditions::cancel_fault(std::size_t fault) {
  std::erase_if(waiting_, [fault](const Waiting& waiting) {
    const auto* begin = std::get_if<FaultBegin>(&waiting.task);
    return begin != nullptr && begin->fault == fault;
  });
}

void Conditions::cancel_directives() { std::erase_if(waiting_, is_directive); }

std::size_t Conditions::directives() const {
  return static_cast<std::size_t>(std::ranges::count_if(waiting_, is_directive));
}

}  // namespace lk::emulator
