#pragma once

/// Protocol of one client: bytes in, frames and answers out. Uses neither sockets nor clocks.

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/frame.hpp"

namespace lk::emulator {

/// Result of a client's bytes.
struct FromClient {
  std::vector<protocol::Frame> frames;  // for the bus
  std::string answer;                   // for the client
  std::string trouble;                  // warning for the log; empty: none
  std::uint64_t malformed = 0;          // malformed lines
};

class ClientProtocol {
 public:
  using Time = std::chrono::nanoseconds;

  ClientProtocol() = default;
  ClientProtocol(const ClientProtocol&) = delete;
  ClientProtocol& operator=(const ClientProtocol&) = delete;
  virtual ~ClientProtocol() = default;

  /// Returns the first bytes sent to a new client.
  virtual std::string greeting() const { return ""; }
  /// Parses bytes received at `now`, in pieces of any size; appends to `heard`.
  virtual void take(std::span<const std::uint8_t> bytes, Time now, FromClient& heard) = 0;
  /// Appends the client's bytes for a frame on the bus. `now` is a reading of the wall clock.
  virtual void show(const protocol::Frame& frame, Time now, std::string& out) = 0;
  /// Records that data for the client was lost.
  virtual void note_loss() {}
  /// Returns when the next frame that the client has scheduled is due.
  virtual std::optional<Time> next_due() const { return std::nullopt; }
  /// Appends the scheduled frames that are due by `now`.
  virtual void take_due(Time /*now*/, std::vector<protocol::Frame>& /*out*/) {}
};

/// Splits a byte stream into lines; keeps an incomplete line for the next call.
class LineBuffer {
 public:
  /// `longest`: limit for a line, without its end character.
  LineBuffer(char end, std::size_t longest) : end_(end), longest_(longest) {}

  /// Calls `on_line(std::string_view)` for each line, and `on_too_long()` at the end of each line
  /// over the limit, which is discarded.
  template <class OnLine, class OnTooLong>
  void take(std::span<const std::uint8_t> bytes, OnLine on_line, OnTooLong on_too_long) {
    for (const std::uint8_t byte : bytes) {
      const char c = static_cast<char>(byte);
      if (c != end_) {
        too_long_ = too_long_ || line_.size() == longest_;
        if (!too_long_) line_ += c;
        continue;
      }
      if (too_long_) {
        on_too_long();
      } else {
        on_line(std::string_view(line_));
      }
      line_.clear();
      too_long_ = false;
    }
  }

 private:
  char end_;
  std::size_t longest_;
  std::string line_;
  bool too_long_ = false;
};

}  // namespace lk::emulator
