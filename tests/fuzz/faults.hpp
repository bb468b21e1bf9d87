#pragma once

/// @file Faults and conditions from the bytes of an input, within the limits of configurations.

#include <algorithm>
#include <chrono>
#include <cmath>

#include "emulator/core/directive.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/servo/signals.hpp"
#include "tests/fuzz/support.hpp"

namespace lk::fuzz {

inline emulator::FaultValue parameter_from(const emulator::FaultParam& param, std::uint8_t byte) {
  if (!param.choices.empty()) {
    return static_cast<emulator::FaultChoice>(byte % param.choices.size());
  }
  const double value = param.min + (param.max - param.min) * byte / 255.0;
  return param.whole ? std::floor(value) : value;
}

/// Returns a fault of the drive `id`.
inline emulator::Fault fault_from(Input& input, int id) {
  using std::chrono::milliseconds;
  const emulator::FaultRow& row =
      emulator::fault_table()[input.byte() % emulator::fault_table().size()];
  emulator::Fault fault = emulator::fault_of(row);
  if (!row.of_bus) fault.ids = {id};
  for (std::size_t n = 0; n < row.params.size() && !row.params[n].word.empty(); ++n) {
    fault.values[n] = parameter_from(row.params[n], input.byte());
  }
  // These ranges are for the largest motors. A small motor diverges there, which verdicts report
  // ("the simulation diverged").
  if (fault.row->word == "load_step" || fault.row->word == "kick") {
    fault.values[0] = fault.values[0].number() / 1000;
  }
  if (row.per_frame) fault.probability = input.byte() / 255.0;
  const std::uint8_t course = input.byte();  // bit 0: has a duration, bit 1: repeats, the rest: ms
  const auto span = milliseconds(1 + (course >> 2U));
  if ((course & 1U) != 0 && !row.momentary()) fault.duration = span;
  if ((course & 2U) != 0 && (fault.duration || row.momentary())) {
    fault.every = span + milliseconds(1);
    fault.times = course >> 6U;
  }
  return fault;
}

inline emulator::Condition condition_from(Input& input, int id) {
  const std::uint8_t what = input.byte();
  const std::uint8_t value = input.byte();
  switch (what & 3U) {
    case 0:
      return {id, emulator::CommandSeen{value, 1 + static_cast<int>(what >> 2U & 3U)}};
    case 1:
      return {id, emulator::ErrorSet{static_cast<model::Error>(value & 7U)}};
    default:
      return {id, emulator::SignalReaches{&emulator::signals()[value % emulator::signals().size()],
                                          static_cast<emulator::Edge>(what % 3U),
                                          static_cast<std::int8_t>(what) * 2.5}};
  }
}

}  // namespace lk::fuzz
