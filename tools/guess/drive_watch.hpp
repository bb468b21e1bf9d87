#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "emulator/monitor/frames/conversation.hpp"
#include "tools/guess/evidence.hpp"
#include "tools/guess/motion_watch.hpp"

namespace lk::emulator {

/// Collects evidence from the frames of one drive.
class DriveWatch {
 public:
  /// Processes a query to the drive, or a multi-drive command.
  void query(const FrameInfo& info, std::optional<SimTime> at);
  /// Processes a reply of the drive; `raw` is the unchanged frame on the bus.
  void reply(const FrameInfo& info, const protocol::Frame& raw, std::optional<SimTime> at);
  /// Processes a frame that may be a reply or a repeated query.
  void unclear(const FrameInfo& info, std::optional<SimTime> at);
  /// Processes the outcome of a query. Call before reply() with the frame that settled it.
  void settle(const QueryOutcome& settled);

  const Evidence& evidence() const { return evidence_; }
  const EncoderWatch& encoder() const { return encoder_; }
  std::uint64_t queries() const { return queries_; }
  std::uint64_t replies() const { return replies_; }
  /// Number of replies whose iq is larger than any LK drive can report.
  std::uint64_t odd_currents() const { return odd_currents_; }
  /// Number of replies to 0x9A and 0x9B that have no layout of an LK drive.
  std::uint64_t odd_states() const { return odd_states_; }

 private:
  void see_answer(const FrameInfo& info, const Sighting& sighting);
  void see_packet(const FrameInfo& info, const Sighting& sighting);
  void see_encoder(const Sighting& sighting);
  void see_field(std::uint16_t counts, std::optional<int> speed_dps, const Sighting& sighting);
  void see_state_1(const Sighting& sighting);
  void see_zero(const Sighting& sighting);
  void see_single_turn(const Sighting& sighting);
  void see_multi_drive(const FrameInfo& info, const Sighting& sighting);
  bool paced(const FrameInfo& info) const;

  Evidence evidence_;
  MotionWatch motion_;
  EncoderWatch encoder_;
  std::uint64_t queries_ = 0;
  std::uint64_t replies_ = 0;
  std::uint64_t odd_currents_ = 0;
  std::uint64_t odd_states_ = 0;
  // Number, shortest and longest latency of frames that are surely replies.
  std::uint64_t timed_ = 0;
  SimTime fastest_{0}, slowest_{0};
  // Unanswered queries since the last reply. Key: the conclusion once the drive answers again.
  std::map<std::pair<Trait, ValueSet>, Frames> silent_;
  std::optional<SimTime> silent_since_;
  bool answered_before_ = false;
  std::optional<SimTime> answered_at_;
  // Multi-drive commands since the last reply to 0x280.
  Frames several_;
  bool several_known_ = false;
  // Time of the reply to 0x80; empty if outdated or already used.
  std::optional<SimTime> off_at_;
};

}  // namespace lk::emulator
