#pragma once

/// @file Converts frames to commands and replies, and back. Decoders accept any input and never
/// throw: they return the reason why a frame is not valid.

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

/// Reason why a frame got no reply. The bus detects the reasons marked "bus", decoders the others.
enum class Reject : std::uint8_t {
  kErrorFrame,      // error frame: a CAN controller reports it, no node sends it
  kCanFd,           // CAN FD frame
  kRemote,          // remote transmission request
  kExtended,        // 29-bit identifier
  kForeignId,       // not 0x140 + ID, and no multi-drive identifier that a drive here knows
  kNoSuchDrive,     // bus: 0x140 + ID of a drive that is not on the bus
  kWrongLength,     // DLC is not 8; LEN does not match the command
  kUnknownCommand,  // unknown DATA[0], or unknown parameter in DATA[1]
  kWrongMode,       // bus: single-drive frame in multi-drive mode; 0x280 without such a drive
  kNoPower,         // bus: the drive is unpowered or booting
  kDriveBusy,       // bus: the drive has too many pending replies, replies on RS-485, or calibrates
  kFault,           // bus: an injected fault kept the frame from the drive
  kQueueFull,       // bus: the host sends faster than the wire carries; its send queue is full
  kNoPacket,        // bytes on RS-485 that are no packet, or that were corrupted on the wire
};
inline constexpr std::size_t kRejects = 14;
/// Returns a short name for logs and summaries, such as "unknown command".
std::string_view to_string(Reject cause);

/// `Query::id` of a multi-drive command.
inline constexpr int kMultiDrive = 0;

struct Query {
  int id = kMultiDrive;  // 1..32, or kMultiDrive
  Command command;
  Payload data{};                 // as received, for replies that repeat the query
  std::uint8_t size = kCanBytes;  // bytes of `data`
};

struct ReplyFrame {
  int id = kMinId;  // 1..32
  Reply reply;
};

/// Returns the description of a command. Pre: the wire has the command.
const CommandInfo& info_of(const Command& command, Framing framing = Framing::kCan);
/// Returns true for a command to several drives.
bool is_multi_drive(const Command& command);

/// Returns DATA[0] of the reply to a command. For a multi-drive command, that is the reply to the
/// equivalent single-drive command. Empty for MultiCommand and Restart.
std::optional<std::uint8_t> reply_command(const Command& command);

/// Returns the address of a frame: a drive's ID or kMultiDrive; or why the frame is no query to any
/// drive. Ignores DATA, so it never returns kUnknownCommand, nor kWrongLength for an RS-485 packet.
std::variant<int, Reject> address(const Frame& frame);

/// Decodes a query as a drive does. Clamps fields to their range, except the target and direction
/// of 0xA5/0xA6 and the action of 0x8C, which the drive checks itself. Returns kForeignId for a
/// multi-drive identifier that this drive does not have; on MS drives, 0x280 is kUnknownCommand.
std::variant<Query, Reject> decode_query(const Frame& frame, const WireFormat& format);

/// Returns the query that the drive `id` executes. For a MultiCommand, that is the command in the
/// drive's slot, with a payload of zeros; kForeignId if the drive has no slot. Other queries are
/// returned unchanged.
std::variant<Query, Reject> for_drive(int id, const Query& query, const WireFormat& format);

/// Encodes a query to the drive `id` (1..32) as a host does; unused bytes are 0. Multi-drive
/// commands ignore `id`. Pre: the wire of `format` has the command.
Frame encode_query(int id, const Command& command, const WireFormat& format);

/// Encodes a reply of the drive `id` (1..32) as the drive does. Rounds quantities to the nearest
/// LSB and saturates them. Pre: `reply` is not NoReply.
Frame encode_reply(int id, const Reply& reply, const WireFormat& format);

/// Decodes a reply as a host does. Pre: the frame comes from a drive. The caller must know, because
/// query and reply have the same identifier.
std::variant<ReplyFrame, Reject> decode_reply(const Frame& frame, const WireFormat& format);

}  // namespace lk::protocol
