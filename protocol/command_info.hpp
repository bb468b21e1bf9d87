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

/// Source of the description of a command.
enum class Source : std::uint8_t {
  kManual,             // the vendor's CAN manual
  kManualAndHardware,  // the manual; effect confirmed on real drives
  kHardware,           // the manual prints another DATA[0] than real drives use
  kNewerManuals,       // V2.35 and V2.36
  kSecondPrint,        // the second print of V2.36
  kTool,               // sent by the vendor's PC tool on RS-485
};

/// Treatment of a query on RS-485 with a wrong LEN.
enum class WrongLength : std::uint8_t {
  kBySwitch,    // as Dialect::lax_length says
  kSilent,      // no reply
  kAnswered,    // a reply for any LEN
  kEmptyTaken,  // LEN 0 is accepted too
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
  Opcode printed{};  // wrong DATA[0] in the manual, if any
  Opcode each{};     // multi-drive: the equivalent single-drive command, if any
  WrongLength wrong_length = WrongLength::kBySwitch;
  // LEN of an RS-485 query without fields; null: derived from the fields.
  std::uint8_t (*query_len)(const WireFormat& format) = nullptr;
};

struct CommandInfo : CommandTraits {
  Opcode opcode{};               // of a single-drive command
  std::uint32_t identifier = 0;  // of a multi-drive command
  bool echoed = false;           // the reply repeats the query
  bool answered = true;          // false: never a reply
  std::span<const Field> query = {};
  std::span<const Field> reply = {};  // those of the query if echoed
};

/// Return single-drive commands, sorted by their bytes: on CAN, and on RS-485.
std::span<const CommandInfo> commands();
std::span<const CommandInfo> serial_commands();
/// Return multi-drive commands, sorted by their identifiers.
std::span<const CommandInfo> multi_drive_commands();
std::span<const CommandInfo> serial_multi_drive_commands();

/// Returns true if the reply to this byte is a state, with a temperature in DATA[1].
bool has_state(std::uint8_t byte);
/// Returns the command of a byte; null if unknown to all drives.
const CommandInfo* find_command(std::uint8_t byte, Framing framing = Framing::kCan);
/// Returns the command of an identifier; null if it is not a multi-drive one.
const CommandInfo* find_multi_drive(std::uint32_t identifier, Framing framing = Framing::kCan);

/// Returns true if the reply repeats this field, which selects what the query is about.
bool repeats_in_reply(const CommandInfo& command, const Field& field);
/// Returns true if query and reply have the same fields, so that they look alike; not for echoes.
bool looks_like_query(const CommandInfo& command);

constexpr Framing framing_of(const Frame& frame) {
  return is_serial(frame) ? Framing::kSerial : Framing::kCan;
}
/// Returns the command of a frame's DATA[0] on its wire; null if there is none.
inline const CommandInfo* command_of(const Frame& frame) {
  return frame.dlc > 0 && frame.kind != FrameKind::kBytes
             ? find_command(frame.data[0], framing_of(frame))
             : nullptr;
}

/// Range of LEN of a payload on RS-485.
struct PayloadLength {
  std::uint8_t min = 0;
  std::uint8_t max = 0;  // including optional fields
};
/// Returns the LEN of a query or reply with these fields and this DATA.
PayloadLength payload_length(std::span<const Field> fields, const Payload& data,
                             const WireFormat& format);

/// Returns the words of all quantities in replies that are not echoes, without repeats.
std::vector<std::string_view> reply_words();
/// Returns the value of a quantity in a reply; empty if it has none.
std::optional<double> reply_quantity(std::string_view word, const Payload& data,
                                     const WireFormat& format);

/// Returns true if drives of the series have the command, given the firmware.
bool fits(const CommandInfo& command, Series series);
/// Returns true if a drive has the command; a multi-drive one works only in multi-drive mode.
bool knows(const WireFormat& format, const CommandInfo& command);
/// Returns true if a drive answers the byte.
bool answers(const WireFormat& format, Opcode opcode);
/// Returns true if a drive has the identifier, in multi-drive mode.
bool knows_multi_drive(const WireFormat& format, std::uint32_t identifier);

}  // namespace lk::protocol
