#pragma once

/// Protocol slcan of Lawicel's adapters: CAN in ASCII lines (docs/guides/buses.md).

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "emulator/io/transports/client_set.hpp"

namespace lk::emulator {

/// Parses a frame line such as "t1418…" or "R000001410"; nullopt if malformed.
std::optional<protocol::Frame> parse_slcan_frame(std::string_view line);
/// Returns the line for `frame`, without the carriage return. Pre: `frame` is kData or kRemote.
std::string slcan_frame(const protocol::Frame& frame);

/// The adapter that one client sees.
class Slcan final : public ClientProtocol {
 public:
  /// `bitrate`: of the bus, bit/s; 0: the client may set any rate. `acknowledges`: answer each
  /// command; false: answer only F, V, v and N.
  explicit Slcan(std::int64_t bitrate, bool acknowledges = true)
      : bitrate_(bitrate), acknowledges_(acknowledges) {}

  void parse(std::span<const std::uint8_t> bytes, Time now, ParsedInput& parsed) override;
  void encode(const protocol::Frame& frame, Time now, std::string& out) override;
  void note_loss() override { flags_ |= kOverrun; }

 private:
  // Status flags of the command F.
  static constexpr std::uint8_t kOverrun = 1U << 3U;
  static constexpr std::uint8_t kBusError = 1U << 7U;
  static constexpr std::size_t kLongestLine = 26;  // T, an identifier, a length, eight bytes

  /// Returns the answer to a line; nullopt if it is malformed or not allowed now.
  std::optional<std::string> answer(std::string_view line, ParsedInput& parsed);
  std::optional<std::string> send(std::string_view line, ParsedInput& parsed);
  std::optional<std::string> set_rate(std::string_view digit, ParsedInput& parsed);
  std::optional<std::string> set_up(std::string_view line, ParsedInput& parsed);
  std::optional<std::string> open(std::string_view line);
  bool accepts(const protocol::Frame& frame) const;
  /// Returns true if the client has set another bit rate than the bus has: no frame passes.
  bool wrong_rate() const { return bitrate_ > 0 && rate_ && *rate_ != bitrate_; }

  std::int64_t bitrate_;
  bool acknowledges_;
  std::optional<std::int64_t> rate_;  // set by the client
  LineBuffer lines_{'\r', kLongestLine};
  bool open_ = false;
  bool listens_only_ = false;
  bool stamps_ = false;
  std::uint32_t code_ = 0;  // acceptance code; mask_: a bit 1 means "don't care"
  std::uint32_t mask_ = 0xFFFFFFFFU;
  std::uint8_t flags_ = 0;
};

}  // namespace lk::emulator
