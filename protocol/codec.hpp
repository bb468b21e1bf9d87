#pragma once

/// @file Frames to commands and replies, and back. Total on wire input: what cannot be decoded
/// comes back as the reason, nothing throws.

#include <cstdint>
#include <optional>
#include <variant>

#include "protocol/command_table.hpp"
#include "protocol/frame.hpp"
#include "protocol/replies.hpp"
#include "protocol/wire_format.hpp"

namespace lk::protocol {

/// Why a frame is not part of the protocol, in the order in which it is checked.
enum class Reject : std::uint8_t {
  kErrorFrame,
  kCanFd,
  kRemote,
  kExtended,
  kForeignId,       // no drive's, nor one for several drives
  kWrongLength,     // DLC is not 8; LEN is not the command's
  kUnknownCommand,  // this drive has no such command, or no such parameter
  kNoPacket,        // bytes on RS-485 that are no packet, or a frame of the other wire
};

/// `Query::id` of a multi-drive command.
inline constexpr int kMultiDrive = 0;

struct Query {
  int id = kMultiDrive;  // 1..32, or kMultiDrive
  Command command;
  Payload data{};                 // as received, for echoes
  std::uint8_t size = kCanBytes;  // of them
};

struct ReplyFrame {
  int id = kMinId;  // 1..32
  Reply reply;
};

/// The row of a command; on CAN there must be one.
const CommandInfo& info_of(const Command& command, Framing framing = Framing::kCan);
/// Is it one for several drives?
bool is_multi_drive(const Command& command);

/// DATA[0] of the reply to a command: a command to several asks each for that of one. None where
/// each drive is asked for something else.
std::optional<std::uint8_t> reply_command(const Command& command);

/// Whom a frame addresses: a drive's ID, kMultiDrive, or why it is not a query at all, whatever the
/// drive. Does not look at DATA, so never gives kUnknownCommand, nor kWrongLength of a packet.
std::variant<int, Reject> address(const Frame& frame);

/// The drive's side: what the host wants. Fields beyond their range are clamped to it, except the
/// target and direction of 0xA5/0xA6 and the action of 0x8C, which the drive judges itself. An
/// identifier for several drives that this one does not know is foreign to it; 0x280 is an unknown
/// command to MS drives.
std::variant<Query, Reject> decode_query(const Frame& frame, const WireFormat& format);

/// What `query` means to the drive `id`: a MultiCommand becomes the command in the drive's slot,
/// with a payload of zeros, and is foreign to a drive without a slot. All others stay as they are.
std::variant<Query, Reject> for_drive(int id, const Query& query, const WireFormat& format);

/// The host's side: the query frame for the drive `id` (1..32), unused bytes 0. For the commands to
/// several drives the `id` is ignored. The wire of `format` must have the command.
Frame encode_query(int id, const Command& command, const WireFormat& format);

/// The drive's side: the reply frame of the drive `id` (1..32). Quantities round to the nearest LSB
/// and saturate. Not for NoReply.
Frame encode_reply(int id, const Reply& reply, const WireFormat& format);

/// The host's side: what a frame that is known to come from a drive says. (Query and reply share
/// the identifier, so the frame alone does not tell.)
std::variant<ReplyFrame, Reject> decode_reply(const Frame& frame, const WireFormat& format);

}  // namespace lk::protocol
