#include "emulator/config/config_serial.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>

#include "emulator/config/bus_name.hpp"
#include "emulator/core/text.hpp"
#include "protocol/meanings.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {
namespace {

using protocol::bit_rate;
using protocol::kCanRates;
using protocol::kSerialRates;

constexpr std::int64_t kOddRate = 921'600;  // bit/s; manuals list 1 Mbit/s in its place

const protocol::Value* row_of_rate(std::int64_t baud) {
  return std::ranges::find(kSerialRates, baud, bit_rate);
}

std::chrono::nanoseconds from_us(double us) {
  return std::chrono::nanoseconds(protocol::rounded(us * 1e3));
}

const std::vector<std::string> kResync{"scan", "idle"};
const std::vector<std::string> kTermios{"as_tty", "raw"};
const std::vector<std::string> kRate{"enforce", "ignore"};

}  // namespace

std::string baud_problem(std::int64_t baud) {
  if (baud == 0 || (row_of_rate(baud) != std::end(kSerialRates) && baud != kOddRate)) return "";
  std::vector<std::string> rates{"0"};
  for (const protocol::Value& row : kSerialRates) {
    if (bit_rate(row) != kOddRate) rates.emplace_back(row.word);
  }
  return std::to_string(baud) + " is not a bit rate of RS-485 drives: " + comma_list(rates);
}

std::uint8_t rate_code(std::int64_t baud, bool has_921600) {
  const protocol::Value* const row = row_of_rate(baud);
  if (row == std::end(kSerialRates)) return kAsWired;
  const bool moved = !has_921600 && baud > kOddRate;
  return static_cast<std::uint8_t>(row->number - (moved ? 1 : 0));
}

std::int64_t serial_rate_of(std::uint8_t code, bool has_921600) {
  for (const protocol::Value& row : kSerialRates) {
    const std::int64_t rate = bit_rate(row);
    const bool there = has_921600 || rate != kOddRate;
    if (there && rate_code(rate, has_921600) == code) return rate;
  }
  return 0;
}

std::int64_t can_rate_of(std::uint8_t code) {
  return code < std::size(kCanRates) ? bit_rate(kCanRates[code]) : 0;
}

std::uint8_t can_rate_code(std::int64_t bitrate) {
  if (bitrate == 0) return kAsWired;
  const auto* const nearest = std::ranges::min_element(
      kCanRates, {}, [&](const protocol::Value& row) { return std::abs(bit_rate(row) - bitrate); });
  return static_cast<std::uint8_t>(nearest->number);
}

SerialConfig read_serial(TableReader& bus, const std::string& interface) {
  SerialConfig serial;
  auto reader = bus.table("rs485");
  if (!reader) return serial;
  for (const char* const key : {"pty_termios", "pty_rate"}) {
    if (reader->has(key) && scheme_of(interface).transport == Transport::kRs485Tcp) {
      reader->fail(key, "has no effect on rs485-tcp, which has no terminal: remove it");
    }
  }
  if (const auto us = reader->number("reply_us", 0, 100'000)) serial.reply_time = from_us(*us);
  if (const auto us = reader->number("reply_spread_us", 0, 100'000)) {
    serial.reply_spread = from_us(*us);
  }
  if (serial.reply_spread > serial.reply_time) {
    reader->fail(reader->has("reply_spread_us") ? "reply_spread_us" : "reply_us",
                 "the spread must not be above reply_us: a reply would begin before its query");
  }
  if (const auto ms = reader->number("gap_ms", 0.01, 1000)) serial.gap = from_us(*ms * 1e3);
  if (const auto word = reader->choice("resync", kResync)) serial.scan = *word == 0;
  if (const auto len = reader->integer("max_len", 60, protocol::kMaxLen)) {
    serial.max_len = static_cast<std::uint8_t>(*len);
  }
  if (const auto bits = reader->integer("broadcast_gap_bits", 10, 10'000)) {
    serial.broadcast_gap_bits = static_cast<int>(*bits);
  }
  if (const auto hears = reader->boolean("hears_while_replying")) {
    serial.receives_while_replying = *hears;
  }
  if (const auto us = reader->number("broadcast_reply_us", 0, 100'000)) {
    serial.broadcast_reply_time = from_us(*us);
  }
  if (const auto word = reader->choice("pty_termios", kTermios)) serial.as_tty = *word == 0;
  if (const auto word = reader->choice("pty_rate", kRate)) serial.enforces_rate = *word == 0;
  if (const auto codes = reader->integer("baud_codes", 10, 11)) serial.has_921600 = *codes == 11;
  reader->finish();
  return serial;
}

}  // namespace lk::emulator
