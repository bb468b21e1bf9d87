#include "emulator/core/faults/fault_table.hpp"

#include <algorithm>

namespace lk::emulator {
namespace {

using enum FaultGroup;
using K = FaultKind;

constexpr FaultParam number(std::string_view word, double min, double max, double fallback) {
  return {word, min, max, fallback, false, {}};
}
constexpr FaultParam needed(std::string_view word, double min, double max) {
  return {word, min, max, 0, true, {}};
}
constexpr FaultParam choice(std::string_view word, std::string_view choices, double fallback = 0) {
  return {word, 0, 0, fallback, false, choices};
}

constexpr bool kOfBus = true;
constexpr bool kPerFrame = true;
constexpr bool kMomentary = true;

constexpr FaultParam kFrames = choice("frames", "replies queries both");
constexpr FaultParam kPhase = choice("phase", "a b c");
constexpr FaultParam kSide = choice("side", "high low");
constexpr FaultParam kChannel = choice("channel", "a b both");
constexpr FaultParam kSensor = choice("sensor", "motor driver");

/// A row without flags, and with them.
constexpr FaultRow row(K kind, std::string_view word, FaultGroup group, std::string_view about,
                       std::array<FaultParam, kMostFaultParams> params = {}) {
  return {kind, word, group, !kOfBus, !kPerFrame, !kMomentary, about, params};
}
constexpr FaultRow frame_row(K kind, std::string_view word, std::string_view about,
                             std::array<FaultParam, kMostFaultParams> params = {}) {
  return {kind, word, kLink, !kOfBus, kPerFrame, !kMomentary, about, params};
}
constexpr FaultRow moment_row(K kind, std::string_view word, FaultGroup group,
                              std::string_view about,
                              std::array<FaultParam, kMostFaultParams> params = {}) {
  return {kind, word, group, !kOfBus, !kPerFrame, kMomentary, about, params};
}

// One row a line.
// clang-format off
constexpr FaultRow kTable[] = {
    frame_row(K::kDrop, "drop", "the frame is lost: the other side never sees it; a reply is lost before it takes the wire", {kFrames}),
    frame_row(K::kDelay, "delay", "the reply waits in the drive before it is sent, this long plus a random time up to the jitter; later ones wait behind it", {needed("delay_ms", 0, 10'000), number("jitter_ms", 0, 10'000, 0)}),
    frame_row(K::kDuplicate, "duplicate", "the reply is sent this many more times, as far as the drive's queue of 16 has room", {number("copies", 1, 15, 1)}),
    frame_row(K::kCorrupt, "corrupt", "this many bits of the data, different ones each time, are flipped, and no CRC notices (a bad gateway or buffer)", {number("bits", 1, 64, 1), kFrames}),
    frame_row(K::kStale, "stale", "in place of the reply the drive sends again what it said last; since its start, or there is nothing to repeat"),
    frame_row(K::kReorder, "reorder", "the reply is held back and leaves behind the next one of the drive, or when the fault ends; what acknowledges a write to ROM is not held back"),
    frame_row(K::kWrongDlc, "wrong_dlc", "the reply has this many bytes; the rest is cut off", {number("dlc", 0, 7, 4)}),
    frame_row(K::kWrongId, "wrong_id", "the reply's identifier is off by this much, modulo 2048", {number("offset", -2047, 2047, 1)}),
    row(K::kDuplicateId, "duplicate_id", kLink, "a second drive has the same ID: it hears the same, turns a motor of its own, which boots this far (of the rotor) from where the drive boots, and answers too, a little later; it has a supply of its own, and other faults do not reach it", {number("angle_deg", -360'000, 360'000, 90)}),
    row(K::kSilent, "silent", kLink, "the drive hears and obeys, and nothing it sends leaves it"),
    row(K::kBabbling, "babbling", kLink, "the drive sends a frame it was not asked for, over and over: 8 bytes of 0; when the wire is taken, no more than one waits behind another", {number("period_us", 100, 10'000'000, 500), number("can_id", 0, 2047, 0)}),
    {K::kErrorFrames, "error_frames", kLink, kOfBus, kPerFrame, !kMomentary, "a bit error destroys the frame on the wire: all nodes see an error frame, and the sender sends it again, its error counter up by 8; at 256 it gives the frame up and leaves the bus for 128 times 11 bits", {}},
    row(K::kBusOff, "bus_off", kLink, "everything the drive sends is destroyed: its error counter climbs by 8 each time, to error-passive (128) and bus-off (256); all it had to say is lost then, it is deaf and silent for 128 times 11 bits and the recovery time, and comes back with its counters at 0", {number("recovery_ms", 0, 3'600'000, 100)}),
    row(K::kQueueFull, "queue_full", kLink, "nothing leaves the drive's send queue: replies pile up in it, and when it is full (16) queries are ignored; what waits leaves in order when the fault ends"),

    row(K::kEncoderStuck, "encoder_stuck", kSensors, "the encoder keeps showing its last value"),
    row(K::kEncoderJump, "encoder_jump", kSensors, "the encoder is off by this angle of the rotor (slipped magnet)", {needed("angle_deg", -36'000, 36'000)}),
    row(K::kEncoderNoise, "encoder_noise", kSensors, "noise on the encoder, rms, of the rotor", {needed("rms_deg", 0, 180)}),
    row(K::kEncoderDrift, "encoder_drift", kSensors, "the encoder runs away from the rotor at this rate", {needed("rate_dps", -36'000, 36'000)}),
    row(K::kEncoderGarbage, "encoder_garbage", kSensors, "the encoder shows anything, another thing each time"),
    row(K::kEncoderLostMagnet, "encoder_lost_magnet", kSensors, "the encoder no longer sees its magnet: it wanders about where it was"),
    row(K::kEncoderSlow, "encoder_slow", kSensors, "the encoder shows where the rotor was this long ago", {number("latency_ms", 0, 100, 2)}),
    row(K::kCurrentOffset, "current_offset", kSensors, "a current sensor is off by this much", {needed("offset_A", -1000, 1000), kChannel}),
    row(K::kCurrentGain, "current_gain", kSensors, "a current sensor shows the current times this gain", {needed("gain", -10, 10), kChannel}),
    row(K::kCurrentNoise, "current_noise", kSensors, "noise on both current sensors, rms", {needed("rms_A", 0, 1000)}),
    row(K::kCurrentStuck, "current_stuck", kSensors, "a current sensor shows this, regardless of the current", {number("value_A", -1000, 1000, 0), kChannel}),
    row(K::kTemperatureStuck, "temperature_stuck", kSensors, "a temperature sensor shows this", {needed("value_C", -55, 250), kSensor}),
    row(K::kTemperatureOff, "temperature_off", kSensors, "a temperature sensor is off by this much", {needed("offset_C", -300, 300), kSensor}),
    row(K::kVoltageStuck, "voltage_stuck", kSensors, "the voltage sensor shows this", {needed("value_V", 0, 200)}),
    row(K::kVoltageOff, "voltage_off", kSensors, "the voltage sensor is off by this much", {needed("offset_V", -200, 200)}),

    row(K::kPhaseOpen, "phase_open", kPowerStage, "the wire of a phase is broken: no current flows in it", {kPhase}),
    row(K::kSwitchOpen, "switch_open", kPowerStage, "a switch of a phase never closes; its diode still conducts", {kPhase, kSide}),
    row(K::kSwitchShorted, "switch_shorted", kPowerStage, "a switch of a phase never opens: with its partner it shorts the link", {kPhase, kSide}),
    row(K::kBridgeDead, "bridge_dead", kPowerStage, "no switch closes any more, and the firmware does not know"),

    row(K::kJam, "jam", kMechanics, "the output is clamped: dry friction of this share of the motor's peak torque; 100: locked, regardless of the load", {number("percent", 0, 100, 100)}),
    row(K::kFriction, "friction", kMechanics, "all friction is multiplied by this factor", {needed("factor", 0, 1000)}),
    row(K::kInertia, "inertia", kMechanics, "all inertia is multiplied by this factor", {needed("factor", 0.1, 1000)}),
    row(K::kLoadStep, "load_step", kMechanics, "torque on the output in addition, positive pushes clockwise", {needed("torque_Nm", -1000, 1000)}),
    moment_row(K::kKick, "kick", kMechanics, "a blow on the output: this much angular momentum at once", {needed("impulse_Nms", -100, 100)}),
    row(K::kBacklash, "backlash", kMechanics, "the gear's play is multiplied by this factor (motors with an elastic gear only)", {needed("factor", 0, 1000)}),
    row(K::kCouplingBroken, "coupling_broken", kMechanics, "rotor and load have come apart"),
    row(K::kEndStop, "end_stop", kMechanics, "something stands in the way of the output: it gets no further than these angles from where it stands", {number("min_deg", -1e6, 0, -1e6), number("max_deg", 0, 1e6, 1e6)}),

    row(K::kSag, "sag", kPower, "the supply gives no more than this", {needed("to_V", 0, 100)}),
    row(K::kDip, "dip", kPower, "the supply falls this far below the voltage at which the controller is reset", {number("below_reset_V", 0, 60, 1)}),
    row(K::kCut, "cut", kPower, "the supply is disconnected"),
    row(K::kRebootLoop, "reboot_loop", kPower, "the supply comes and goes: off, on, and off again", {number("off_ms", 1, 600'000, 1000), number("on_ms", 1, 600'000, 200)}),
    row(K::kNoRegeneration, "no_regeneration", kPower, "the supply takes nothing back (a rectifier): braking raises the link"),

    moment_row(K::kReset, "reset", kFirmware, "the controller restarts: RAM, turn count, errors and command are gone"),
    row(K::kHang, "hang", kFirmware, "the drive hears nothing and says nothing, a power cycle or not; the motor keeps its last command"),
    row(K::kSlowReplies, "slow_replies", kFirmware, "every reply is ready this much later; what the query asks for is done at once", {number("delay_ms", 0.01, 10'000, 5)}),
    row(K::kClockDrift, "clock_drift", kFirmware, "the drive's clock is fast by this share: speeds, ramps and times are off by it", {needed("percent", -20, 20)}),
    row(K::kRomWriteFails, "rom_write_fails", kFirmware, "a write to ROM is acknowledged and changes nothing there"),
    row(K::kRomWorn, "rom_worn", kFirmware, "the memory has seen all the writes it can take: what is written does not stay"),
    moment_row(K::kRomDamaged, "rom_damaged", kFirmware, "a parameter in ROM is lost: it reads as delivered at the next start", {choice("parameter", "gains acceleration encoder_offset max_torque_current max_power max_speed max_angle current_ramp broadcast_mode protections all", 10)}),
    moment_row(K::kRamFlipped, "ram_flipped", kFirmware, "a bit of a setting in RAM flips; which one, the seed decides", {choice("parameter", "gains acceleration encoder_offset max_torque_current max_power max_speed max_angle current_ramp broadcast_mode", 5)}),
    row(K::kForgetsBroadcast, "forgets_broadcast", kFirmware, "the drive wakes up without its mode for several drives"),
    row(K::kForgetsLimits, "forgets_limits", kFirmware, "the drive wakes up with the limits it was delivered with"),
};
// clang-format on

constexpr bool rows_stand_by_kind() {
  for (std::size_t n = 0; n < std::size(kTable); ++n) {
    if (kTable[n].kind != static_cast<FaultKind>(n)) return false;
  }
  return std::size(kTable) == kFaultKinds;
}
static_assert(rows_stand_by_kind());

}  // namespace

std::string_view to_string(FaultGroup group) {
  switch (group) {
    case kLink:
      return "link";
    case kSensors:
      return "sensors";
    case kPowerStage:
      return "power stage";
    case kMechanics:
      return "mechanics";
    case kPower:
      return "power";
    case kFirmware:
      return "firmware and memory";
  }
  return "";
}

std::span<const FaultRow> fault_table() { return kTable; }

const FaultRow& fault_row(FaultKind kind) { return kTable[static_cast<std::size_t>(kind)]; }

const FaultRow* find_fault(std::string_view word) {
  const auto* const found = std::ranges::find(kTable, word, &FaultRow::word);
  return found != std::end(kTable) ? found : nullptr;
}

}  // namespace lk::emulator
