#pragma once

/// @file The rows of command_table.hpp as plain data, for all who go through them.

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/field.hpp"
#include "protocol/frame.hpp"
#include "protocol/opcodes.hpp"

namespace lk::protocol {

/// Which series know a command. MS drives set voltages and have no current sensors.
enum class Fits : std::uint8_t { kAllSeries, kMsOnly, kAllButMs };

/// Where the knowledge of a command comes from.
enum class Source : std::uint8_t {
  kManual,             // the vendor's CAN manual
  kManualAndHardware,  // the manual, and its effect confirmed on real drives
  kHardware,           // the manual prints another DATA[0]; real drives use this one
  kNewerManuals,       // V2.35 and V2.36
  kSecondPrint,        // the second print of V2.36
  kTool,               // what the vendor's PC tool sends on RS-485
};

/// What becomes of a query on RS-485 whose LEN is not the command's.
enum class WrongLength : std::uint8_t {
  kBySwitch,    // as Dialect::lax_length has it
  kSilent,      // no reply
  kAnswered,    // whatever LEN is
  kEmptyTaken,  // LEN 0 is taken too
};

/// What a row says besides its fields.
struct CommandTraits {
  std::string_view name;  // for people
  std::string_view name_zh = {};
  std::string_view word = {};  // of scenarios
  Source source = Source::kManual;
  Fits fits = Fits::kAllSeries;
  When when = kAlways;
  bool writes_rom = false;
  Opcode printed{};  // DATA[0] of the reply that the manual misprints, if it does
  Opcode each{};     // of a command to several: what it is to each, where that is the same
  WrongLength wrong_length = WrongLength::kBySwitch;
  // LEN of a query of RS-485 that no field describes; null: the fields have it.
  std::uint8_t (*query_len)(const WireFormat& format) = nullptr;
};

struct CommandInfo : CommandTraits {
  Opcode opcode{};               // of one to a drive
  std::uint32_t identifier = 0;  // of one to several
  bool echoed = false;           // the reply repeats the query
  bool answered = true;          // it has a reply at all
  std::span<const Field> query = {};
  std::span<const Field> reply = {};  // those of the query, where it is echoed
};

/// Commands to one drive, their bytes ascending: on CAN, and on RS-485.
std::span<const CommandInfo> commands();
std::span<const CommandInfo> serial_commands();
/// Commands to several, their identifiers ascending.
std::span<const CommandInfo> multi_drive_commands();
std::span<const CommandInfo> serial_multi_drive_commands();

/// The reply to this byte is a state, whose DATA[1] is a temperature.
bool has_state(std::uint8_t byte);
/// The command of a byte; null when no drive knows it.
const CommandInfo* find_command(std::uint8_t byte, Framing framing = Framing::kCan);
/// The command of an identifier; null when it is not one for several drives.
const CommandInfo* find_multi_drive(std::uint32_t identifier, Framing framing = Framing::kCan);

/// The reply repeats this field of the query, which says what the command is about.
bool repeats_in_reply(const CommandInfo& command, const Field& field);
/// What a reply says a query says too, so that one may look like the other; not an echo.
bool reply_says_the_same(const CommandInfo& command);

/// The wire of a frame.
constexpr Framing framing_of(const Frame& frame) {
  return is_serial(frame) ? Framing::kSerial : Framing::kCan;
}
/// The command that DATA[0] of a frame is on its wire; null: none, or no data.
inline const CommandInfo* command_of(const Frame& frame) {
  return frame.dlc > 0 && frame.kind != FrameKind::kBytes
             ? find_command(frame.data[0], framing_of(frame))
             : nullptr;
}

/// The lengths that a payload of RS-485 can have.
struct PayloadLength {
  std::uint8_t min = 0;
  std::uint8_t max = 0;  // with the fields that may be left out
};
/// LEN of a query or reply with these fields and this DATA.
PayloadLength payload_length(std::span<const Field> fields, const Payload& data,
                             const WireFormat& format);

/// The quantities that replies of their own have, by their words, each once.
std::vector<std::string_view> reply_words();
/// What a reply says of one; nothing where it does not.
std::optional<double> reply_quantity(std::string_view word, const Payload& data,
                                     const WireFormat& format);

/// Do drives of the series know it, those with the firmware for it?
bool fits(const CommandInfo& command, Series series);
/// Does a drive know the command? Those to several it knows in multi-drive mode only.
bool knows(const WireFormat& format, const CommandInfo& command);
/// Does it answer the byte?
bool answers(const WireFormat& format, Opcode opcode);
/// Does it know the identifier, in multi-drive mode?
bool knows_multi_drive(const WireFormat& format, std::uint32_t identifier);

}  // namespace lk::protocol
