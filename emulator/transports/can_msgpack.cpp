#include "emulator/transports/can_msgpack.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

namespace lk::emulator {
namespace {

using Message = nlohmann::ordered_json;
using protocol::Frame;
using protocol::FrameKind;

/// A missing flag is false, as in python-can. Returns nullopt if it is not a boolean.
std::optional<bool> flag(const Message& message, const char* name) {
  const auto found = message.find(name);
  if (found == message.end()) return false;
  return found->is_boolean() ? std::optional(found->get<bool>()) : std::nullopt;
}

std::optional<std::uint64_t> number_up_to(const Message& message, const char* name,
                                          std::uint64_t most) {
  const auto found = message.find(name);
  if (found == message.end() || !found->is_number_unsigned()) return std::nullopt;
  const auto value = found->get<std::uint64_t>();
  return value <= most ? std::optional(value) : std::nullopt;
}

bool take_data(const Message& message, Frame& frame) {
  const auto length = number_up_to(message, "dlc", protocol::kCanBytes);
  if (!length) return false;
  frame.dlc = static_cast<std::uint8_t>(*length);
  if (frame.kind == FrameKind::kRemote) return true;
  const auto data = message.find("data");
  if (data == message.end() || !data->is_binary()) return false;
  const auto& bytes = data->get_binary();
  if (bytes.size() != *length) return false;
  std::ranges::copy(bytes, frame.data.begin());
  return true;
}

}  // namespace

std::optional<Frame> parse_can_msgpack(std::span<const std::uint8_t> bytes) {
  if (bytes.size() > kLongestCanMsgpack) return std::nullopt;  // also limits the nesting depth
  constexpr bool kWholly = true;
  constexpr bool kThrow = false;
  const Message message = Message::from_msgpack(bytes.begin(), bytes.end(), kWholly, kThrow);
  if (!message.is_object()) return std::nullopt;
  const auto extended = flag(message, "is_extended_id");
  const auto remote = flag(message, "is_remote_frame");
  const auto error = flag(message, "is_error_frame");
  const auto fd = flag(message, "is_fd");
  if (!extended || !remote || !error || !fd) return std::nullopt;
  const auto id = number_up_to(message, "arbitration_id",
                               *extended ? protocol::kMostExtendedId : protocol::kMostStandardId);
  if (!id) return std::nullopt;
  Frame frame;
  frame.id = static_cast<std::uint32_t>(*id);
  frame.extended = *extended;
  frame.kind = *error    ? FrameKind::kError
               : *fd     ? FrameKind::kFd
               : *remote ? FrameKind::kRemote
                         : FrameKind::kData;
  if (*error || *fd) {
    frame.dlc = 0;
    return frame;
  }
  return take_data(message, frame) ? std::optional(frame) : std::nullopt;
}

std::vector<std::uint8_t> can_msgpack(const Frame& frame, std::chrono::nanoseconds stamp) {
  const bool remote = frame.kind == FrameKind::kRemote;
  const std::vector<std::uint8_t> data(frame.data.begin(),
                                       frame.data.begin() + (remote ? 0 : frame.dlc));
  const Message message{
      {"timestamp", std::chrono::duration<double>(stamp).count()},
      {"arbitration_id", frame.id},
      {"is_extended_id", frame.extended},
      {"is_remote_frame", remote},
      {"is_error_frame", frame.kind == FrameKind::kError},
      {"channel", nullptr},
      {"dlc", frame.dlc},
      {"data", Message::binary(data)},
      {"is_fd", false},
      {"bitrate_switch", false},
      {"error_state_indicator", false},
  };
  return Message::to_msgpack(message);
}

}  // namespace lk::emulator
