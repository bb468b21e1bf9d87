#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <utility>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/given.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// What a host does with a drive that is off or has an error.
class TroubleWatch {
 public:
  /// A host that asks for errors sees one within this time, and one that does not is to be told.
  static constexpr SimTime kUnseen = std::chrono::seconds(2);  // assumed
  /// What is on its way while a host still makes up its mind is no mistake.
  static constexpr SimTime kReaction = std::chrono::milliseconds(100);  // assumed
  static constexpr int kQueries = 10;                                   // assumed
  /// Who pauses for longer may come back later; who has not, and goes silent for so long, has left.
  static constexpr SimTime kPause = std::chrono::seconds(1);    // assumed
  static constexpr SimTime kSilence = std::chrono::seconds(5);  // assumed
  /// An error that a look sees may have been in the answer to a query that is no older.
  static constexpr SimTime kLookedLate = std::chrono::milliseconds(5);

  std::optional<Finding> hear(const Heard& heard, const Suspect& suspect, const KnownDrive& drive);

  struct Seen {
    Finding finding;
    Suspect suspect;
    std::uint64_t times;
  };
  /// The drive was just looked at, at `now`, when it had all frames up to the number `arrived`.
  /// What it has refused, or that it was left in error.
  std::optional<Seen> look(SimTime now, std::uint64_t arrived, const KnownDrive& drive);
  /// The drive is to be looked at, though nobody speaks to it.
  bool waits() const { return error_ && error_->was_spoken_to && !error_->cared_for; }

 private:
  struct Error {
    SimTime since{0};
    std::optional<SimTime> asked = std::nullopt;  // by 0x9A or 0x9B
    bool cared_for = false;                       // by these, or by 0x80 or 0x88
    int queries = 0;                              // from kUnseen on
    bool was_spoken_to = false;                   // for kUnseen, without a pause, not asked
  };
  std::optional<Seen> left_alone(SimTime now, const KnownDrive& drive);
  bool to_be_told(SimTime now) const;
  /// The first of so many that were refused, among those with numbers from `before` on, exclusive,
  /// to `arrived`.
  const Suspect& first_of(std::uint64_t times, std::uint64_t before, std::uint64_t arrived) const;

  std::optional<Error> error_;
  std::optional<SimTime> asked_;  // for its state, error or not
  Suspect last_;                  // of all that it was sent
  SimTime spoken_to_since_{0};    // without a pause
  SimTime quiet_until_{0};
  std::uint64_t refused_ = 0;  // so far
  std::uint64_t arrived_ = 0;
  bool off_ = false;  // switched off last, not on
  struct Motion {
    Suspect suspect;
    bool off = false;
  };
  static constexpr std::size_t kKept = 32;  // more than the wire carries from look to look
  std::array<Motion, kKept> motions_{};     // a ring
  std::size_t motion_count_ = 0;
};

}  // namespace lk::emulator
