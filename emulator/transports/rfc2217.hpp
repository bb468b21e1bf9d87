#pragma once

/// @file Telnet as it carries a serial port: RFC 854, RFC 855 and RFC 2217, the side that has the
/// port. Data are binary, whether or not the client agrees on that (RFC 856).

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lk::emulator {

class Rfc2217 {
 public:
  /// Interpret as command.
  static constexpr std::uint8_t kIac = 255;
  /// Behind kIac this byte begins a negotiation, with which a client of telnet begins.
  static bool begins(std::uint8_t byte) { return byte >= kSubBegin && byte != kIac; }

  /// `rate`, bit/s, is what a client is told that asks before it has set one.
  explicit Rfc2217(std::uint32_t rate) : rate_(rate) {}

  struct Answer {
    std::string bytes;            // for the client
    std::uint64_t malformed = 0;  // commands that make no sense
  };
  /// What a client is told when it has begun.
  static std::string greeting();
  /// Takes in a byte of the client. Returns it if it is data; adds to `answer`.
  std::optional<std::uint8_t> take(std::uint8_t byte, Answer& answer);
  /// Data for the client.
  static void put(std::span<const std::uint8_t> data, std::string& out);

  /// As the client has set it, bit/s.
  std::uint32_t rate() const { return rate_; }

 private:
  static constexpr std::uint8_t kSubBegin = 250;
  /// What is kept of a command: all that has a meaning here is shorter.
  static constexpr std::size_t kLongest = 64;

  /// Of an option: we do it, the client does it.
  struct Option {
    std::uint8_t code;
    bool ours = false;
    bool theirs = false;
  };
  enum class State : std::uint8_t { kData, kCommand, kOption, kSub, kSubCommand };

  std::optional<std::uint8_t> command(std::uint8_t byte, Answer& answer);
  void negotiate(std::uint8_t option, Answer& answer);
  void end_sub(Answer& answer);
  /// False: it makes no sense.
  bool obey(std::uint8_t code, std::span<const std::uint8_t> value, std::string& out);
  /// What the port then has, as it is answered; nothing: it makes no sense.
  std::optional<std::uint8_t> in_force(std::uint8_t code, std::uint8_t value);
  std::optional<std::uint8_t> control(std::uint8_t value);

  State state_ = State::kData;
  std::uint8_t verb_ = 0;
  std::vector<std::uint8_t> sub_;
  std::vector<Option> options_{{0, true, true}, {3}, {44}};  // binary is offered in the greeting
  bool told_modem_ = false;
  std::uint32_t rate_;
  bool break_ = false;
  bool dtr_ = false;
  bool rts_ = false;
};

}  // namespace lk::emulator
