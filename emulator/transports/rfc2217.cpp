#include "emulator/transports/rfc2217.hpp"

#include <algorithm>

namespace lk::emulator {
namespace {

// RFC 854
constexpr std::uint8_t kSubEnd = 240;
constexpr std::uint8_t kWill = 251;
constexpr std::uint8_t kWont = 252;
constexpr std::uint8_t kDo = 253;
constexpr std::uint8_t kDont = 254;
constexpr std::uint8_t kFirstCommand = kSubEnd;
// RFC 856, RFC 2217
constexpr std::uint8_t kBinary = 0;
constexpr std::uint8_t kComPort = 44;

/// Commands of RFC 2217. What the server says has these and 100.
enum ComPort : std::uint8_t {
  kSignature = 0,
  kBaudrate = 1,
  kDatasize = 2,
  kParity = 3,
  kStopsize = 4,
  kControl = 5,
  kLineState = 6,
  kModemState = 7,
  kSuspend = 8,
  kResume = 9,
  kLineStateMask = 10,
  kModemStateMask = 11,
  kPurge = 12,
};
constexpr std::uint8_t kOfServer = 100;
// What is in force, and stays so: 8 bits, no parity, 1 stop bit, no flow control; of a modem there
// is nothing.
constexpr std::uint8_t kEightBits = 8;
constexpr std::uint8_t kNoParity = 1;
constexpr std::uint8_t kOneStopBit = 1;
constexpr std::uint8_t kNoFlowControl = 1;
constexpr std::uint8_t kNoFlowControlIn = 14;
constexpr std::uint8_t kNoModem = 0;

void put_command(std::string& out, std::uint8_t verb, std::uint8_t option) {
  for (const std::uint8_t byte : {std::uint8_t{255}, verb, option}) {
    out += static_cast<char>(byte);
  }
}

/// IAC SB COM-PORT-OPTION code value IAC SE
void say(std::string& out, std::uint8_t code, std::span<const std::uint8_t> value) {
  put_command(out, 250, kComPort);
  out += static_cast<char>(code + kOfServer);
  Rfc2217::put(value, out);
  out += "\xFF\xF0";
}

void say(std::string& out, std::uint8_t code, std::uint8_t value) { say(out, code, {&value, 1}); }

}  // namespace

std::string Rfc2217::greeting() {
  std::string out;
  put_command(out, kWill, kBinary);
  put_command(out, kDo, kBinary);
  return out;
}

void Rfc2217::put(std::span<const std::uint8_t> data, std::string& out) {
  for (const std::uint8_t byte : data) {
    out.append(byte == kIac ? 2 : 1, static_cast<char>(byte));
  }
}

std::optional<std::uint8_t> Rfc2217::take(std::uint8_t byte, Answer& answer) {
  switch (state_) {
    case State::kData:
      if (byte != kIac) return byte;
      state_ = State::kCommand;
      break;
    case State::kCommand:
      return command(byte, answer);
    case State::kOption:
      state_ = State::kData;
      negotiate(byte, answer);
      break;
    case State::kSub:
      if (byte == kIac) {
        state_ = State::kSubCommand;
      } else if (sub_.size() <= kLongest) {
        sub_.push_back(byte);
      }
      break;
    case State::kSubCommand:
      if (byte == kIac) {
        if (sub_.size() <= kLongest) sub_.push_back(byte);
        state_ = State::kSub;
      } else if (byte == kSubEnd) {
        state_ = State::kData;
        end_sub(answer);
      } else {  // it has no end: another command stands there
        ++answer.malformed;
        return command(byte, answer);
      }
      break;
  }
  return std::nullopt;
}

/// Behind IAC.
std::optional<std::uint8_t> Rfc2217::command(std::uint8_t byte, Answer& answer) {
  state_ = State::kData;
  if (byte == kIac) return byte;
  if (byte == kSubBegin) {
    sub_.clear();
    state_ = State::kSub;
  } else if (byte > kSubBegin) {
    verb_ = byte;
    state_ = State::kOption;
  } else if (byte <= kFirstCommand) {  // none, or an end without a beginning
    ++answer.malformed;
  }
  return std::nullopt;  // the others, like Are You There, are of no account
}

/// What changes nothing is not answered, or two could go on for ever (RFC 854).
void Rfc2217::negotiate(std::uint8_t code, Answer& answer) {
  const bool wants = verb_ == kDo || verb_ == kWill;
  const bool of_us = verb_ == kDo || verb_ == kDont;
  const auto option = std::ranges::find(options_, code, &Option::code);
  if (option == options_.end()) {
    if (wants) put_command(answer.bytes, of_us ? kWont : kDont, code);
    return;
  }
  bool& there = of_us ? option->ours : option->theirs;
  if (there == wants) return;
  there = wants;
  const std::uint8_t yes = of_us ? kWill : kDo;
  const std::uint8_t no = of_us ? kWont : kDont;
  put_command(answer.bytes, wants ? yes : no, code);
  if (code == kComPort && wants && !told_modem_) {
    told_modem_ = true;
    say(answer.bytes, kModemState, kNoModem);
  }
}

void Rfc2217::end_sub(Answer& answer) {
  if (!sub_.empty() && sub_[0] != kComPort) return;  // of an option that was not agreed on
  const bool whole = sub_.size() >= 2 && sub_.size() <= kLongest;
  if (!whole || !obey(sub_[1], std::span(sub_).subspan(2), answer.bytes)) ++answer.malformed;
}

bool Rfc2217::obey(std::uint8_t code, std::span<const std::uint8_t> value, std::string& out) {
  constexpr std::string_view kName = "lk-emu";
  switch (code) {
    case kSignature:  // with a text it is the client's own
      if (value.empty()) say(out, code, std::vector<std::uint8_t>(kName.begin(), kName.end()));
      return true;
    case kBaudrate: {
      if (value.size() != 4) return false;
      std::uint32_t rate = 0;
      for (const std::uint8_t byte : value) rate = rate << 8U | byte;
      if (rate != 0) rate_ = rate;  // 0: what is it?
      const auto byte = [this](unsigned shift) {
        return static_cast<std::uint8_t>(rate_ >> shift);
      };
      say(out, code, std::vector{byte(24), byte(16), byte(8), byte(0)});
      return true;
    }
    case kLineState:
    case kModemState:
      say(out, code, kNoModem);
      return true;
    case kSuspend:
    case kResume:
      return true;  // nothing here waits for a client
    default: {
      const auto now = value.size() == 1 ? in_force(code, value[0]) : std::nullopt;
      if (now) say(out, code, *now);
      return now.has_value();
    }
  }
}

std::optional<std::uint8_t> Rfc2217::in_force(std::uint8_t code, std::uint8_t value) {
  switch (code) {
    case kDatasize:
      return kEightBits;
    case kParity:
      return kNoParity;
    case kStopsize:
      return kOneStopBit;
    case kControl:
      return control(value);
    case kLineStateMask:
    case kModemStateMask:
    case kPurge:  // nothing is kept that could be
      return value;
    default:
      return std::nullopt;
  }
}

std::optional<std::uint8_t> Rfc2217::control(std::uint8_t value) {
  /// Three values for one thing: what is it, on, off.
  const auto set = [value](std::uint8_t first, bool& what) -> std::uint8_t {
    if (value != first) what = value == first + 1;
    return static_cast<std::uint8_t>(first + (what ? 1 : 2));
  };
  switch (value) {
    case 0:
    case 1:
    case 2:
    case 3:
    case 17:
    case 19:
      return kNoFlowControl;
    case 13:
    case 14:
    case 15:
    case 16:
    case 18:
      return kNoFlowControlIn;
    case 4:
    case 5:
    case 6:
      return set(4, break_);
    case 7:
    case 8:
    case 9:
      return set(7, dtr_);
    case 10:
    case 11:
    case 12:
      return set(10, rts_);
    default:
      return std::nullopt;
  }
}

}  // namespace lk::emulator
