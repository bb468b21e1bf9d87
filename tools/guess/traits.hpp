#pragma once

/// @file What the bytes on a bus can tell about a drive: the switches of docs/protocol.md §10.1
/// that show, and its series.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "emulator/core/bus_config.hpp"
#include "emulator/ground/language.hpp"
#include "protocol/opcodes.hpp"

namespace lk::emulator {

/// In the order of how much they say about a drive, and how often they show.
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
  kSeries,
};
inline constexpr std::size_t kTraitCount = static_cast<std::size_t>(Trait::kSeries) + 1;
inline constexpr std::size_t kMostValues = 3;

/// A set of values of a trait, bit n for value n.
using ValueSet = std::uint8_t;
constexpr ValueSet only(std::size_t value) { return static_cast<ValueSet>(1U << value); }
constexpr bool contains(ValueSet set, std::size_t value) {
  return (unsigned{set} >> value & 1U) != 0;
}

// Values by their place in the row of the trait; of a switch that is on or off, 0 is off.
inline constexpr std::size_t kSwitchedOff = 0;
inline constexpr std::size_t kSwitchedOn = 1;
inline constexpr std::size_t kNarrow = 0;  // 16 bits
inline constexpr std::size_t kWide = 1;    // 32 bits
inline constexpr std::size_t kRotorTurn = 0;
inline constexpr std::size_t kOutputTurn = 1;
inline constexpr std::size_t kNoProduct = 0;
inline constexpr std::size_t kShortProduct = 1;  // 42 bytes
inline constexpr std::size_t kLongProduct = 2;   // 58 bytes
inline constexpr std::size_t kNotMs = 0;
inline constexpr std::size_t kMs = 1;

enum class Wires : std::uint8_t { kCan, kSerial, kBoth };

struct TraitRow {
  std::string_view key;  // the name of the switch; of kSeries, of nothing
  std::size_t count;     // of values
  std::array<std::string_view, kMostValues> values;  // as --quirk takes them
  std::array<Words, kMostValues> meanings;           // what a drive does
  /// Which value a drive with these switches has; null where they do not say.
  std::size_t (*of)(const Quirks& quirks);
  std::string_view probe;              // DATA of a query that would tell, or of the first of them
  Words how;                           // what else it takes to tell; without a probe, all of it
  Wires wires = Wires::kCan;           // on which it shows
  std::string_view serial_probe = {};  // CMD and data of a packet that would tell
};

const TraitRow& row_of(Trait trait);
/// All values of a trait.
ValueSet all_of(Trait trait);
/// Frames of the wire can tell it.
bool shows_on(Trait trait, protocol::Framing framing);
/// There is a query that would tell.
bool has_probe(Trait trait, protocol::Framing framing);
/// The query that would tell, as cansend takes it; empty: there is none.
std::string probe_text(Trait trait, int drive, protocol::Framing framing);

/// The trait that decides whether a drive answers the command on the wire; none: all drives do.
std::optional<Trait> trait_behind(protocol::Opcode opcode, protocol::Framing framing);

/// Switches that change no byte that tells them from anything else.
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
    "open_loop_limit_permille",
    "wrong_len",
};

}  // namespace lk::emulator
