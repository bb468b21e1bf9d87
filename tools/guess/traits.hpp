#pragma once

/// @file Traits of a drive that show on a bus: its series, and switches of
/// docs/reference/protocol.md §10.1.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/language.hpp"
#include "protocol/opcodes.hpp"

namespace lk::emulator {

/// Properties by which drives differ, and which a log can show. Sorted: traits that tell most about
/// a drive and show most often come first.
enum class Trait : std::uint8_t {
  kReplyId,
  kState1,
  kSingleTurn,
  kPid,
  kOffset,
  kBrake,
  kParameters,
  kMaxTorque,
  kSettings,
  kCalibrate,
  kZeroReply,
  kOpenLoop,
  kSeveral,
  kErrorBits,
  kReplyBytes,
  kClearAngle,
  kRunResumes,
  kSpeedLimit,
  kEncoderForm,
  kProduct,
  kClearTurns,
  kZeroRam,
  kZeroRamLen,
  kZeroAnswered,
  kTool,
  kRestore,
  kEncoderSpan,
  kEncoderBits,
  kSeries,
};
inline constexpr std::size_t kTraitCount = static_cast<std::size_t>(Trait::kSeries) + 1;
inline constexpr std::size_t kMaxValues = 3;

/// A set of values of a trait: bit n is set if the set contains value n.
using ValueSet = std::uint8_t;
constexpr ValueSet only(std::size_t value) { return static_cast<ValueSet>(1U << value); }
constexpr bool contains(ValueSet set, std::size_t value) {
  return (unsigned{set} >> value & 1U) != 0;
}

// Values of traits: indices into TraitRow::values.
inline constexpr std::size_t kSwitchedOff = 0;
inline constexpr std::size_t kSwitchedOn = 1;
inline constexpr std::size_t kNarrow = 0;  // 16 bits
inline constexpr std::size_t kWide = 1;    // 32 bits
inline constexpr std::size_t kRotorTurn = 0;
inline constexpr std::size_t kOutputTurn = 1;
inline constexpr std::size_t k14Bits = 0;
inline constexpr std::size_t k16Bits = 1;
inline constexpr std::size_t kNoProduct = 0;
inline constexpr std::size_t kShortProduct = 1;  // 42 bytes
inline constexpr std::size_t kLongProduct = 2;   // 58 bytes
inline constexpr std::size_t kNotMs = 0;
inline constexpr std::size_t kMs = 1;

enum class Wires : std::uint8_t { kCan, kSerial, kBoth };

struct TraitRow {
  std::string_view key;                             // name of the switch; empty for kSeries
  std::size_t count;                                // number of values
  std::array<std::string_view, kMaxValues> values;  // as --quirk takes them
  std::array<BilingualText, kMaxValues> meanings;   // what a drive does
  /// Returns the value of a drive with these switches. Null if switches do not define the value.
  std::size_t (*of)(const Quirks& quirks);
  std::string_view probe;              // DATA of the first query that decides the trait
  BilingualText how;                   // further steps; without a probe, all steps
  Wires wires = Wires::kCan;           // where frames show the trait
  std::string_view serial_probe = {};  // CMD and data of an RS-485 packet that decides the trait
};

const TraitRow& row_of(Trait trait);
/// Returns all values of a trait.
ValueSet all_of(Trait trait);
/// Returns true if frames on CAN or RS-485 (`framing`) can show the trait.
bool shows_on(Trait trait, protocol::Framing framing);
/// Returns true if a query decides the trait.
bool has_probe(Trait trait, protocol::Framing framing);
/// Returns the query that decides the trait, in the format of cansend; empty if there is none.
std::string probe_text(Trait trait, int drive, protocol::Framing framing);

/// Returns the trait that decides whether a drive answers the command; empty if all drives do.
std::optional<Trait> trait_of_command(protocol::Opcode opcode, protocol::Framing framing);

/// Switches that no frame shows.
inline constexpr std::string_view kNeverShown[] = {
    "single_turn_target_bits",
    "iq_scale",
    "phase_current_scale",
    "iq_command_limit_lsb",
    "stop_holds",
    "offset_write_takes_effect",
    "boot_wrap",
    "parameter_ranges",
    "zero_stops",
    "restart_command",
    "id_change",
    "id_change_reply",
    "setting_read",
    "calibrate_busy",
    "current_loop",
    "open_loop_limit_permille",
    "wrong_len",
};

}  // namespace lk::emulator
