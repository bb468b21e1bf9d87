#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <utility>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/given.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Watches hosts that use a drive which is off or has an error.
class TroubleWatch {
 public:
  /// A host that asks for errors sees one within this time; a host that does not gets advice.
  static constexpr SimTime kUnseen = std::chrono::seconds(2);  // assumed
  /// Frames sent before a host can react are no mistake.
  static constexpr SimTime kReaction = std::chrono::milliseconds(100);  // assumed
  static constexpr int kQueries = 10;                                   // assumed
  /// A host that pauses for longer may return; one that did not, and is silent so long, has left.
  static constexpr SimTime kPause = std::chrono::seconds(1);    // assumed
  static constexpr SimTime kSilence = std::chrono::seconds(5);  // assumed
  /// An error seen at a look may be in the answer to a query of at most this age.
  static constexpr SimTime kLookedLate = std::chrono::milliseconds(5);

  std::optional<Finding> hear(const Heard& heard, const Suspect& suspect, const KnownDrive& drive);

  struct Seen {
    Finding finding;
    Suspect suspect;
    std::uint64_t times;
  };
  /// Call after each look at the drive, at `now`. `arrived`: number of the last frame that it had
  /// received. Returns refused commands, or that the host left it in error.
  std::optional<Seen> look(SimTime now, std::uint64_t arrived, const KnownDrive& drive);
  /// Returns true if the drive must be looked at without frames for it.
  bool waits() const { return error_ && error_->was_spoken_to && !error_->cared_for; }

 private:
  struct Error {
    SimTime since{0};
    std::optional<SimTime> asked = std::nullopt;  // by 0x9A or 0x9B
    bool cared_for = false;                       // by these, or by 0x80 or 0x88
    int queries = 0;                              // since kUnseen has passed
    bool was_spoken_to = false;                   // for kUnseen, no pause, state not read
  };
  std::optional<Seen> left_alone(SimTime now, const KnownDrive& drive);
  bool to_be_told(SimTime now) const;
  /// Returns the first of the last `times` refused commands, among those with numbers above
  /// `before` and up to `arrived`.
  const Suspect& first_of(std::uint64_t times, std::uint64_t before, std::uint64_t arrived) const;

  std::optional<Error> error_;
  std::optional<SimTime> asked_;  // a query of its state, error or not
  Suspect last_;                  // last frame for the drive
  SimTime spoken_to_since_{0};    // without a pause
  SimTime quiet_until_{0};
  std::uint64_t refused_ = 0;  // total so far
  std::uint64_t arrived_ = 0;
  bool off_ = false;  // last switched off, not on
  struct Motion {
    Suspect suspect;
    bool off = false;
  };
  static constexpr std::size_t kKept = 32;  // more than the wire carries between looks
  std::array<Motion, kKept> motions_{};     // a ring
  std::size_t motion_count_ = 0;
};

}  // namespace lk::emulator
