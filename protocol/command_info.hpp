#pragma once

/// @file The rows of command_table.hpp as plain data, for code that iterates over them.

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/field.hpp"
#include "protocol/frame.hpp"
#include "protocol/opcodes.hpp"

namespace lk::protocol {

/// Series that have a command. MS drives set voltages and have no current sensors.
enum class Fits : std::uint8_t { kAllSeries, kMsOnly, kAllButMs };

/// Source of our knowledge about a command.
enum class Source : std::uint8_t {
  kManual,             // the vendor's CAN manual
  kManualAndHardware,  // the manual; real drives confirm the effect
  kHardware,           // real drives; the manual prints a wrong DATA[0]
  kNewerManuals,       // the manuals V2.35 and V2.36
  kSecondPrint,        // the second print of V2.36
  kTool,               // the vendor's PC tool, which sends it on RS-485
};

/// Treatment of an RS-485 query of the command with a wrong LEN.
enum class WrongLength : std::uint8_t {
  kBySwitch,    // accepted if Dialect::lax_length, else no reply
  kSilent,      // no reply
  kAnswered,    // any LEN is accepted
  kEmptyTaken,  // LEN 0 is accepted; another wrong LEN is treated as in kBySwitch
};

/// Properties of a command besides its fields.
struct CommandTraits {
  std::string_view name;  // for people
  std::string_view name_zh = {};
  std::string_view word = {};  // key in scenarios
  Source source = Source::kManual;
  Fits fits = Fits::kAllSeries;
  When when = kAlways;
  bool writes_rom = false;
  Opcode printed{};  // the wrong DATA[0] that the manual prints; 0: none
  Opcode each{};     // multi-drive: the equivalent single-drive command; 0: none
  WrongLength wrong_length = WrongLength::kBySwitch;
  // Returns the LEN of an RS-485 query without fields; null: the fields define the LEN.
  std::uint8_t (*query_len)(const WireFormat& format) = nullptr;
};

struct CommandInfo : CommandTraits {
  Opcode opcode{};               // of a single-drive command
  std::uint32_t identifier = 0;  // of a multi-drive command; 0: single-drive
  bool echoed = false;           // the reply repeats the query
  bool answered = true;          // false: drives execute the command without a reply
  std::span<const Field> query = {};
  std::span<const Field> reply = {};  // equal to `query` if `echoed`
};

/// Return the single-drive commands of CAN and of RS-485, sorted by DATA[0].
std::span<const CommandInfo> commands();
std::span<const CommandInfo> serial_commands();
/// Return the multi-drive commands of CAN and of RS-485, sorted by identifier.
std::span<const CommandInfo> multi_drive_commands();
std::span<const CommandInfo> serial_multi_drive_commands();

/// Returns true if the reply to the command with DATA[0] = `byte` has a temperature in DATA[1].
bool has_state(std::uint8_t byte);
/// Returns the command with DATA[0] = `byte`; null if no drive knows it.
const CommandInfo* find_command(std::uint8_t byte, Framing framing = Framing::kCan);
/// Returns the multi-drive command with this identifier; null if there is none.
const CommandInfo* find_multi_drive(std::uint32_t identifier, Framing framing = Framing::kCan);

/// Returns true if `field` selects a parameter or setting, and the reply repeats the field.
bool repeats_in_reply(const CommandInfo& command, const Field& field);
/// Returns true if query and reply have the same fields, so that their bytes do not tell which is
/// which. False for commands whose reply repeats the query.
bool looks_like_query(const CommandInfo& command);

constexpr Framing framing_of(const Frame& frame) {
  return is_serial(frame) ? Framing::kSerial : Framing::kCan;
}
/// Returns the command with the frame's DATA[0] on the frame's wire; null if there is none.
inline const CommandInfo* command_of(const Frame& frame) {
  return frame.dlc > 0 && frame.kind != FrameKind::kBytes
             ? find_command(frame.data[0], framing_of(frame))
             : nullptr;
}

/// Shortest and longest LEN of a payload on RS-485.
struct PayloadLength {
  std::uint8_t min = 0;
  std::uint8_t max = 0;  // with optional fields
};
/// Returns the LEN of a query or reply with these fields; DATA decides which of them it has.
PayloadLength payload_length(std::span<const Field> fields, const Payload& data,
                             const WireFormat& format);

/// Returns the words of all quantities in replies, each once. Excludes echoes of the query.
std::vector<std::string_view> reply_words();
/// Returns the quantity `word` of a reply, in its unit; empty if the reply does not have it.
std::optional<double> reply_quantity(std::string_view word, const Payload& data,
                                     const WireFormat& format);

/// Returns true if drives of the series have the command in some firmware.
bool fits(const CommandInfo& command, Series series);
/// Returns true if a drive with this format has the command. It executes multi-drive commands only
/// in multi-drive mode.
bool knows(const WireFormat& format, const CommandInfo& command);
/// Returns true if a drive with this format has the single-drive command.
bool answers(const WireFormat& format, Opcode opcode);
/// Returns true if a drive with this format has the multi-drive command of this identifier.
bool knows_multi_drive(const WireFormat& format, std::uint32_t identifier);

}  // namespace lk::protocol
