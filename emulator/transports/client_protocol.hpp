#pragma once

/// @file What one client says and is told, in the bytes of its protocol: values that know neither
/// sockets nor clocks.

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/frame.hpp"

namespace lk::emulator {

/// What a client's bytes came to.
struct FromClient {
  std::vector<protocol::Frame> frames;  // for the bus
  std::string answer;                   // for the client
  std::string trouble;                  // for the log, when there is some: once for each client
  std::uint64_t malformed = 0;          // lines that make no sense
};

class ClientProtocol {
 public:
  using Time = std::chrono::nanoseconds;

  ClientProtocol() = default;
  ClientProtocol(const ClientProtocol&) = delete;
  ClientProtocol& operator=(const ClientProtocol&) = delete;
  virtual ~ClientProtocol() = default;

  /// What a new client is told.
  virtual std::string greeting() const { return ""; }
  /// Takes in bytes that came at `now`, in pieces of any size; adds to `heard`.
  virtual void take(std::span<const std::uint8_t> bytes, Time now, FromClient& heard) = 0;
  /// Appends what the client is told of a frame on the bus. `now` is a reading of the wall clock.
  virtual void show(const protocol::Frame& frame, Time now, std::string& out) = 0;
  /// Something that was for the client is lost.
  virtual void note_loss() {}
  /// When the client wants a frame sent of which it has spoken before.
  virtual std::optional<Time> next_due() const { return std::nullopt; }
  /// Adds those that are due by `now`.
  virtual void take_due(Time /*now*/, std::vector<protocol::Frame>& /*out*/) {}
};

/// Lines, of which a piece may be all that has come yet.
class LineBuffer {
 public:
  /// A line may have `longest` characters without its end.
  LineBuffer(char end, std::size_t longest) : end_(end), longest_(longest) {}

  /// Calls `on_line(std::string_view)` for each line, and `on_too_long()` at the end of those that
  /// are too long, which are not kept.
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
