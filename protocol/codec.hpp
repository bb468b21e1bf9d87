#pragma once

/// @file Conversion of frames to commands and replies, and back. Decoders accept any input and
/// never throw: they return the reason why a frame is not valid.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>

#include "protocol/command_table.hpp"
#include "protocol/frame.hpp"
#include "protocol/replies.hpp"
#include "protocol/wire_format.hpp"

namespace lk::protocol {

/// Why a frame got no reply. Causes marked "bus" are found by the bus, the others by the decoders.
enum class Reject : std::uint8_t {
  kErrorFrame,      // reported by a controller, sent by no node
  kCanFd,           // CAN FD frame
  kRemote,          // remote transmission request
  kExtended,        // 29-bit identifier
  kForeignId,       // neither a drive's identifier nor a multi-drive one that a drive here knows
  kNoSuchDrive,     // bus: identifier of a drive that is not on it
  kWrongLength,     // DLC is not 8; LEN does not match the command
  kUnknownCommand,  // unknown DATA[0], or unknown parameter in DATA[1]
  kWrongMode,       // bus: single-drive frame in multi-drive mode; 0x280, no drive in that mode
  kNoPower,         // bus: the drive is unpowered or booting
  kDriveBusy,       // bus: too many pending replies; replying on RS-485, or calibrating
  kFault,           // bus: an injected fault kept the frame from the drive
  kQueueFull,       // bus: the host sends faster than the wire carries; its send queue is full
  kNoPacket,        // bytes on RS-485 that are not a packet, or that the wire spoiled
};
inline constexpr std::size_t kRejects = 14;
/// A short name for logs and summaries: "unknown command".
std::string_view to_string(Reject cause);

/// `Query::id` of a multi-drive command.
inline constexpr int kMultiDrive = 0;

struct Query {
  int id = kMultiDrive;  // 1..32, or kMultiDrive
  Command command;
  Payload data{};                 // as received, for echoes
  std::uint8_t size = kCanBytes;  // bytes of `data`
};

struct ReplyFrame {
  int id = kMinId;  // 1..32
  Reply reply;
};

/// Returns the row of a command. Pre: the wire has the command.
const CommandInfo& info_of(const Command& command, Framing framing = Framing::kCan);
/// Returns true for a command to several drives.
bool is_multi_drive(const Command& command);

/// Returns DATA[0] of the reply. A multi-drive command gets the reply of its single-drive command.
/// Empty for MultiCommand and Restart.
std::optional<std::uint8_t> reply_command(const Command& command);

/// Returns the address of a frame: a drive's ID or kMultiDrive; or why the frame is no query of any
/// drive. Ignores DATA, so it never returns kUnknownCommand, nor kWrongLength for a packet.
std::variant<int, Reject> address(const Frame& frame);

/// Decodes a query, for the drive. Clamps fields to their range, except the target and direction of
/// 0xA5/0xA6 and the action of 0x8C, which the drive checks itself. Returns kForeignId for a
/// multi-drive identifier that this drive does not have; on MS drives, 0x280 is kUnknownCommand.
std::variant<Query, Reject> decode_query(const Frame& frame, const WireFormat& format);

/// Returns `query` as seen by the drive `id`. A MultiCommand becomes the command in the drive's
/// slot, with a payload of zeros; without a slot, it is kForeignId. Other queries stay as they are.
std::variant<Query, Reject> for_drive(int id, const Query& query, const WireFormat& format);

/// Encodes a query to the drive `id` (1..32), for the host; unused bytes are 0. Multi-drive
/// commands ignore `id`. Pre: the wire of `format` has the command.
Frame encode_query(int id, const Command& command, const WireFormat& format);

/// Encodes a reply of the drive `id` (1..32), for the drive. Quantities round to the nearest LSB
/// and saturate. Pre: `reply` is not NoReply.
Frame encode_reply(int id, const Reply& reply, const WireFormat& format);

/// Decodes a reply, for the host. Pre: the frame comes from a drive. The frame alone does not tell,
/// because query and reply have the same identifier.
std::variant<ReplyFrame, Reject> decode_reply(const Frame& frame, const WireFormat& format);

}  // namespace lk::protocol
