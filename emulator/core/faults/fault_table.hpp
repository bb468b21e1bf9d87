#pragma once

/// @file The one table of faults: words, parameters, units and effects. What reads, lists and
/// documents faults reads it here.

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "emulator/core/fault.hpp"

namespace lk::emulator {

enum class FaultGroup : std::uint8_t {
  kLink,
  kSensors,
  kPowerStage,
  kMechanics,
  kPower,
  kFirmware
};
std::string_view to_string(FaultGroup group);

/// One parameter of a kind. Its unit is the end of its word.
struct FaultParam {
  std::string_view word;  // "percent"; empty: the kind has no more
  double min = 0, max = 0;
  double fallback = 0;       // when it is not said
  bool required = false;     // it has to be said
  std::string_view choices;  // "queries replies both": a word of these; min, max do not count
};

struct FaultRow {
  FaultKind kind;
  std::string_view word;  // "encoder_stuck"
  FaultGroup group;
  bool of_bus;     // of the bus as a whole: takes no drives
  bool per_frame;  // acts on frames: takes a probability
  bool momentary;  // done at once: takes no duration
  std::string_view about;
  std::array<FaultParam, kMostFaultParams> params;
};

/// By kind.
std::span<const FaultRow> fault_table();
const FaultRow& fault_row(FaultKind kind);
/// None: null.
const FaultRow* find_fault(std::string_view word);

}  // namespace lk::emulator
