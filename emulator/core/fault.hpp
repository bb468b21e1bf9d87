#pragma once

/// @file Faults as plain values: what is injected, and what came of it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Every kind that the program has; `fault_table.hpp` says what each does.
enum class FaultKind : std::uint8_t {
  // link
  kDrop,
  kDelay,
  kDuplicate,
  kCorrupt,
  kStale,
  kReorder,
  kWrongDlc,
  kWrongId,
  kDuplicateId,
  kSilent,
  kBabbling,
  kErrorFrames,
  kBusOff,
  kQueueFull,
  // sensors
  kEncoderStuck,
  kEncoderJump,
  kEncoderNoise,
  kEncoderDrift,
  kEncoderGarbage,
  kEncoderLostMagnet,
  kEncoderSlow,
  kCurrentOffset,
  kCurrentGain,
  kCurrentNoise,
  kCurrentStuck,
  kTemperatureStuck,
  kTemperatureOff,
  kVoltageStuck,
  kVoltageOff,
  // power stage
  kPhaseOpen,
  kSwitchOpen,
  kSwitchShorted,
  kBridgeDead,
  // mechanics
  kJam,
  kFriction,
  kInertia,
  kLoadStep,
  kKick,
  kBacklash,
  kCouplingBroken,
  kEndStop,
  // power
  kSag,
  kDip,
  kCut,
  kRebootLoop,
  kNoRegeneration,
  // firmware and memory
  kReset,
  kHang,
  kSlowReplies,
  kClockDrift,
  kRomWriteFails,
  kRomWorn,
  kRomDamaged,
  kRamFlipped,
  kForgetsBroadcast,
  kForgetsLimits,
};
inline constexpr std::size_t kFaultKinds = 56;
inline constexpr std::size_t kMostFaultParams = 3;

/// A fault as it is asked for. It begins when its directive is performed; a trigger is the
/// directive's (TimedDirective).
struct Fault {
  std::string name;  // tells it from the others of its bus
  FaultKind kind = FaultKind::kDrop;
  std::vector<int> ids;  // the drives that have it, ascending; empty: the bus as a whole
  // In the order and the units of the kind's row; a choice of words is the word's place.
  std::array<double, kMostFaultParams> values{};
  double probability = 1;           // of each frame, for kinds that act on frames
  std::optional<SimTime> duration;  // of each time; absent: until it is cleared
  // From one beginning to the next, longer than `duration`; absent: once.
  std::optional<SimTime> every;
  int times = 0;  // beginnings in all, with `every`; 0: no end
};

/// What has become of a fault.
struct FaultEvidence {
  enum class State : std::uint8_t { kArmed, kActive, kPaused, kOver, kCleared };
  State state = State::kArmed;
  SimTime armed_at{0};
  std::optional<SimTime> began_at;         // first
  std::optional<SimTime> first_effect_at;  // something was otherwise than without the fault
  // Frames; blows and writes; of what lasts, the instants of looking (Bus::kLookStep) at which it
  // showed, of each drive. 0: none.
  std::uint64_t effects = 0;
  std::string first_on;  // what the first effect was on: "drive 2", "drive 2, 142#9C…"
};

struct FaultReport {
  Fault fault;
  FaultEvidence evidence;
};

}  // namespace lk::emulator
