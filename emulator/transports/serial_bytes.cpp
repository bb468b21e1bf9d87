#include "emulator/transports/serial_bytes.hpp"

#include <fmt/format.h>

#include <utility>

#include "protocol/serial_framing.hpp"

namespace lk::emulator {
namespace {

/// Of drives as they are delivered.
constexpr std::uint32_t kUsualRate = 115'200;

}  // namespace

void SerialBytes::take(std::span<const std::uint8_t> bytes, Time /*now*/, FromClient& heard) {
  data_.clear();
  Rfc2217::Answer answer;
  for (const std::uint8_t byte : bytes) take_byte(byte, answer);
  heard.answer += answer.bytes;
  heard.malformed += answer.malformed;
  protocol::append_frames(data_, heard.frames);
  if (misread_at_ != 0) {
    heard.trouble = fmt::format("is at {} bit/s and the drives are at {}: nobody understands it",
                                std::exchange(misread_at_, 0U), bitrate_);
  }
}

void SerialBytes::take_byte(std::uint8_t byte, Rfc2217::Answer& answer) {
  if (telnet_) {
    const auto data = telnet_->take(byte, answer);
    if (!data) return;
    data_.push_back(wrong_rate() ? misread(*data) : *data);
    if (wrong_rate()) misread_at_ = telnet_->rate();
    return;
  }
  const First before = first_;
  if (before == First::kNothing && byte == Rfc2217::kIac) {
    first_ = First::kIac;
    return;
  }
  first_ = First::kOther;
  if (before != First::kIac) {
    data_.push_back(byte);
  } else if (!Rfc2217::begins(byte)) {
    data_.insert(data_.end(), {Rfc2217::kIac, byte});
  } else {
    telnet_.emplace(bitrate_ > 0 ? static_cast<std::uint32_t>(bitrate_) : kUsualRate);
    answer.bytes += Rfc2217::greeting();
    take_byte(Rfc2217::kIac, answer);
    take_byte(byte, answer);
  }
}

void SerialBytes::show(const protocol::Frame& frame, Time /*now*/, std::string& out) {
  const protocol::WireBytes wire = protocol::wire_bytes(frame);
  if (wrong_rate()) return;  // a host at another rate reads rubbish, if anything
  if (telnet_) {
    Rfc2217::put(wire.view(), out);
  } else {
    out.append(wire.view().begin(), wire.view().end());
  }
}

}  // namespace lk::emulator
