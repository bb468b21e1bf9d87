#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/core/language.hpp"
#include "emulator/monitor/frames/candump_text.hpp"
#include "emulator/monitor/frames/conversation.hpp"
#include "tools/guess/drive_watch.hpp"
#include "tools/guess/guess.hpp"

namespace lk::emulator {

/// Evidence from one interface, and from one of CAN and RS-485.
struct GuessedBus {
  explicit GuessedBus(std::span<const FrameReader> readers) : conversation(readers) {}

  Conversation conversation;
  std::map<int, DriveWatch> drives;  // by ID
  std::uint64_t frames = 0;
  std::uint64_t others = 0;  // frames that belong to no drive
};

/// Finds out from lines of candump which firmware and motors the drives have.
class Guesser {
 public:
  struct Options {
    bool json = false;
    Language language = Language::kEnglish;
    /// Returns the profile name of the motor with this label (any text); empty if none has it.
    std::function<std::string(const std::string& label)> motor_of = {};
  };
  explicit Guesser(Options options);

  /// Processes a line without its line end. Returns an empty text; finish() returns the result.
  std::string take(std::string_view line);
  /// Ends the input and returns the findings.
  std::string finish();

  std::uint64_t frames() const { return frames_; }
  std::uint64_t bad_lines() const { return bad_lines_; }
  /// Number of ignored frames, from interfaces beyond kMaxInterfaces.
  std::uint64_t unread_frames() const { return unread_frames_; }
  const std::string& first_problem() const { return first_problem_; }
  /// Returns the conclusion for one drive.
  Guess guess(const DriveWatch& drive) const;
  using Buses = std::map<std::pair<std::string, protocol::Framing>, GuessedBus>;
  const Buses& buses() const { return buses_; }
  /// Time of the first frame; empty without time stamps.
  std::optional<SimTime> begin() const { return begin_; }

  static constexpr std::size_t kMaxInterfaces = 32;

 private:
  void refuse(const std::string& problem);
  void classify(GuessedBus& bus, const BusFrame& observed);

  Options options_;
  std::vector<FrameReader> can_readers_;
  std::vector<FrameReader> serial_readers_;
  StampReader stamps_;
  Buses buses_;
  std::uint64_t frames_ = 0;
  std::uint64_t lines_ = 0;
  std::uint64_t bad_lines_ = 0;
  std::uint64_t unread_frames_ = 0;
  std::string first_problem_;
  std::optional<SimTime> begin_;
  bool steps_ = false;
};

}  // namespace lk::emulator
