#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "emulator/monitor/advice/advice.hpp"
#include "emulator/monitor/advice/watch_input.hpp"

namespace lk::emulator {

/// Reports unasked motions of a drive (core/servo/unasked.hpp), and the frames that started them.
class UnaskedWatch {
 public:
  /// A drive that turns on for this time after the silence counts was left turning (assumed).
  static constexpr SimTime kLeft = std::chrono::seconds(1);

  void on_query(const DecodedQuery& query, const Suspect& suspect);
  /// Returns true during an unasked motion: the drive must be observed every time.
  bool runs() const { return runs_; }
  /// `last`: last frame for the drive.
  void observe(const KnownDrive& drive, SimTime now, const Suspect& last, AdviceLog& log);

 private:
  static constexpr std::size_t kKept = 8;
  Suspect starter(const UnaskedMotion& motion) const;

  std::array<Suspect, kKept> recent_{};  // frames that may start a motion; a ring
  std::size_t next_ = 0;
  bool runs_ = false;
  std::uint64_t number_ = 0;       // of the last observed motion
  bool reported_ = false;          // `number_` has advice
  std::uint64_t first_lunge_ = 0;  // number of the motion whose values the advice shows
};

/// Detects a host that takes each reply for the answer to its next query. After a late reply, such
/// a host sends its next query when the reply to the query before the last one comes.
class AnswerWatch {
 public:
  static constexpr int kTimes = 10;
  /// So many replies in a row that may be answers end a shift: the late reply was lost (assumed).
  static constexpr int kPlain = 3;

  std::optional<Finding> on_query(SimTime at, const KnownDrive& drive);
  void on_reply(SimTime at, const KnownDrive& drive);

 private:
  SimTime asked_{0};    // time of the last query
  int replies_ = 0;     // since then
  bool early_ = false;  // one came before the answer to the last query can have come
  int in_step_ = 0;     // queries in a row with one reply that may be the answer
  bool late_ = false;   // after queries in step, a query came before the reply to the last one
  int shifted_ = 0;     // queries in a row since then with one reply
};

}  // namespace lk::emulator
