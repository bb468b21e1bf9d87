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
  std::vector<ReplayedFrame> before;   // frames of that bus just before the difference
};

/// Gives the inputs of a recording to emulated buses and compares the replies with the recorded
/// ones: frame, order, and time in microseconds. Stops at the first difference. Pre: calls come in
/// the order of the recording. `n` is the index of a bus.
class Replay {
 public:
  /// Maximum size of Difference::before.
  static constexpr std::size_t kContext = 8;

  explicit Replay(const std::vector<BusConfig>& buses);
  Replay(const Replay&) = delete;
  Replay& operator=(const Replay&) = delete;
  ~Replay() = default;

  std::optional<std::size_t> find(std::string_view interface) const;
  Bus& bus(std::size_t n) { return lines_[n].bus; }

  /// Advances bus `n` to `until`. Replaceable, to sample the bus on the way (ReplayCsvFile).
  std::function<void(std::size_t n, SimTime until)> advance = [this](std::size_t n, SimTime t) {
    lines_[n].bus.advance_to(t);
  };
  /// Called with every frame of hosts and of emulated drives, if set.
  std::function<void(std::size_t n, const ReplayedFrame& frame)> on_frame;

  void host_frame(std::size_t n, SimTime at, const protocol::Frame& frame);
  void recorded_reply(std::size_t n, const TimedFrame& reply);
  /// Advances the bus to the time of an input that is not a frame. Pre: all recorded replies up to
  /// then were passed. Returns false after a difference.
  bool advance_to(std::size_t n, SimTime at);
  /// Ends the recording of this bus at `at`. A reply without a match by then is a difference.
  void end(std::size_t n, SimTime at);
  /// Time of the last entry of this bus in the recording.
  SimTime last(std::size_t n) const { return lines_[n].last; }
  /// Ends a truncated recording. Emulated replies after its last line are not differences.
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
    SimTime last{0};  // time of the last entry in the recording
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

/// Returns several lines that describe a difference: its time, both frames decoded, and the frames
/// before. A first line warns if another version of lk-emu made the recording. `bus`: configuration
/// of the bus.
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
  bool complete = false;  // the recording has its end, so it was not cut off
  bool cut_line = false;  // the last line of the frames is cut off; it is ignored
  SimTime until{0};       // simulated time of the last entry
};

/// Runs `replay`, made from `recording.buses`, with the recording in `directory`, to its end or the
/// first difference. Calls `progress` from time to time. Throws StartError if a file cannot be
/// read.
ReplayEnd replay_recording(const std::filesystem::path& directory, const Recording& recording,
                           Replay& replay, const std::function<void(SimTime)>& progress = {});

}  // namespace lk::emulator
