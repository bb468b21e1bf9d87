#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/monitor/record/recording.hpp"
#include "emulator/monitor/scenario/csv_writer.hpp"

namespace lk::emulator {

/// A frame on a replayed bus.
struct ReplayedFrame {
  TimedFrame timed;
  bool from_host = false;
};

/// A difference between emulator and recording.
struct Difference {
  std::string bus;
  std::optional<TimedFrame> recorded;  // absent: not in the recording
  std::optional<TimedFrame> replayed;  // absent: not from the emulator
  std::vector<ReplayedFrame> before;   // last frames of that bus without a difference
};

/// Replays the inputs of a recording, given in its order, and compares the replies: frame, order,
/// and time in microseconds. Stops at the first difference. `n` is the index of a bus.
class Replay {
 public:
  /// Number of earlier frames that a difference shows.
  static constexpr std::size_t kContext = 8;

  explicit Replay(const std::vector<BusConfig>& buses);
  Replay(const Replay&) = delete;
  Replay& operator=(const Replay&) = delete;
  ~Replay() = default;

  std::optional<std::size_t> find(std::string_view interface) const;
  Bus& bus(std::size_t n) { return lines_[n].bus; }

  /// Advances a bus to a time; an observer may stop on the way.
  std::function<void(std::size_t n, SimTime until)> advance = [this](std::size_t n, SimTime t) {
    lines_[n].bus.advance_to(t);
  };
  /// Called with every frame of the replay.
  std::function<void(std::size_t n, const ReplayedFrame& frame)> on_frame;

  void host_frame(std::size_t n, SimTime at, const protocol::Frame& frame);
  void recorded_reply(std::size_t n, const TimedFrame& reply);
  /// Advances the bus to a time at which another input acts. Pre: all replies up to then were
  /// passed. Returns false after a difference.
  bool advance_to(std::size_t n, SimTime at);
  /// Ends the recording of this bus at `at`.
  void end(std::size_t n, SimTime at);
  /// Time of the last entry of this bus in the recording.
  SimTime last(std::size_t n) const { return lines_[n].last; }
  /// Ends a truncated recording: replies after its last line are no difference.
  void break_off();

  const std::optional<Difference>& difference() const { return difference_; }
  std::uint64_t host_frames() const { return host_frames_; }
  std::uint64_t equal_replies() const { return equal_replies_; }

 private:
  struct Line {
    std::string interface;
    Bus bus;
    std::deque<TimedFrame> recorded;  // not yet compared
    std::deque<TimedFrame> replayed;
    std::deque<ReplayedFrame> before;
    SimTime last{0};  // in the recording
  };

  void run(std::size_t n, SimTime until);
  void compare(Line& line);
  void differ(Line& line);
  void note(Line& line, const ReplayedFrame& frame);

  std::vector<Line> lines_;
  std::vector<TimedFrame> taken_;  // kept to reuse its memory
  std::optional<Difference> difference_;
  std::uint64_t host_frames_ = 0;
  std::uint64_t equal_replies_ = 0;
};

/// Describes a difference for the user: time, both frames decoded, and the frames before. First it
/// warns if another version of lk-emu made the recording. `bus`: configuration of the bus. Has
/// several lines.
std::string difference_text(const Difference& difference, const BusConfig& bus,
                            const RecordingInfo& recording);

/// Options of `lk-emu replay --csv`.
struct ReplayCsv {
  std::string file;
  std::vector<const Signal*> signals;
  SimTime period{0};
};

/// Writes signals of all drives of a replay, at equal steps of simulated time.
class ReplayCsvFile {
 public:
  /// Makes `replay` stop at each sample. Throws StartError.
  ReplayCsvFile(const ReplayCsv& csv, const std::vector<BusConfig>& buses, Replay& replay);
  ReplayCsvFile(const ReplayCsvFile&) = delete;
  ReplayCsvFile& operator=(const ReplayCsvFile&) = delete;
  ~ReplayCsvFile() = default;

  void commit() { file_.commit(); }

 private:
  CsvFile file_;
};

/// How a replay ended.
struct ReplayEnd {
  bool complete = false;  // the recording was ended properly, not cut off
  bool cut_line = false;  // cut off inside a line, which is ignored
  SimTime until{0};       // simulated time of the last entry
};

/// Runs `replay`, made from `recording.buses`, with the recording in `directory`, to its end or the
/// first difference. Calls `progress` from time to time. Throws StartError if a file cannot be
/// read.
ReplayEnd replay_recording(const std::filesystem::path& directory, const Recording& recording,
                           Replay& replay, const std::function<void(SimTime)>& progress = {});

}  // namespace lk::emulator
