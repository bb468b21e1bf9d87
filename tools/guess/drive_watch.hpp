#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "emulator/frames/conversation.hpp"
#include "tools/guess/encoder_watch.hpp"
#include "tools/guess/evidence.hpp"
#include "tools/guess/motion_watch.hpp"

namespace lk::emulator {

/// Draws from the frames of one drive what they tell of it.
class DriveWatch {
 public:
  /// A query to the drive, or a command for several drives.
  void query(const Told& told, std::optional<SimTime> at);
  /// A reply of the drive; `heard` as it was on the bus.
  void reply(const Told& told, const protocol::Frame& heard, std::optional<SimTime> at);
  /// What may be the query again.
  void unclear(const Told& told, std::optional<SimTime> at);
  /// What has become of a query. To be told before the reply that settled it.
  void settle(const Settled& settled);

  const Evidence& evidence() const { return evidence_; }
  const EncoderWatch& encoder() const { return encoder_; }
  std::uint64_t queries() const { return queries_; }
  std::uint64_t replies() const { return replies_; }
  /// Replies whose iq is more than any LK drive's.
  std::uint64_t odd_currents() const { return odd_currents_; }
  /// Replies to 0x9A and 0x9B that have no LK drive's layout.
  std::uint64_t odd_states() const { return odd_states_; }

 private:
  void see_answer(const Told& told, const Sighting& sighting);
  void see_packet(const Told& told, const Sighting& sighting);
  void see_encoder(const Sighting& sighting);
  void see_state_1(const Sighting& sighting);
  void see_zero(const Sighting& sighting);
  void see_single_turn(const Sighting& sighting);
  void see_several(const Told& told, const Sighting& sighting);
  bool paced(const Told& told) const;

  Evidence evidence_;
  MotionWatch motion_;
  EncoderWatch encoder_;
  std::uint64_t queries_ = 0;
  std::uint64_t replies_ = 0;
  std::uint64_t odd_currents_ = 0;
  std::uint64_t odd_states_ = 0;
  // Of the sure replies: how long they took.
  std::uint64_t timed_ = 0;
  SimTime fastest_{0}, slowest_{0};
  // Queries that had no reply since the last that had one, by what that says if it lasts.
  std::map<std::pair<Trait, ValueSet>, Frames> silent_;
  std::optional<SimTime> silent_since_;
  bool answered_before_ = false;
  std::optional<SimTime> answered_at_;
  // Commands for several drives since the last reply to 0x280.
  Frames several_;
  bool several_known_ = false;
  // Since when it is off, and whether that has been used.
  std::optional<SimTime> off_at_;
};

}  // namespace lk::emulator
