#pragma once

/// @file Mistakes of hosts, one row for each kind (docs/guides/host-mistakes.md).

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/language.hpp"
#include "emulator/core/sim_time.hpp"
#include "protocol/command_info.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

enum class AdviceKind : std::uint8_t {
  kRomWear,
  kMotionRefused,
  kSpeedAsPosition,
  kFieldRange,
  kOtherGeneration,
  kWrongLength,
  kSeveralHosts,
  kFasterThanWire,
  kFasterThanDrive,
  kNotWaited,
  kInputWindow,
  kWindUp,
  kJump,
  kMultiWithoutMode,
  kSingleInMultiMode,
  kErrorIgnored,
  kDuplicateId,
  kUnknownCommand,
  kTrustsClearReply,
  kPollsDead,
  kTimeoutBelowLatency,
  kFirstTargetFar,
  kParameterSpace,
  kSettingNotSaved,
  kTtyNotRaw,
  kZeroWithoutPayload,
  kCanPadding,
  kTalksOverReply,
  kEchoTaken,
  kSumWrong,
  kCalibrationUnderLoad,
};
inline constexpr std::size_t kAdviceKinds =
    static_cast<std::size_t>(AdviceKind::kCalibrationUnderLoad) + 1;

struct AdviceRow {
  AdviceKind kind;
  std::string_view word;  // stable, as programs read it
  BilingualText rule;     // condition, as in the documents
  BilingualText todo;
  bool is_per_cause = false;    // one advice for each cause
  BilingualText serial_todo{};  // for RS-485, if `todo` is about CAN
};

/// All rows, in the order of AdviceKind.
std::span<const AdviceRow> advice_table();
const AdviceRow& advice_row(AdviceKind kind);

/// Mistake that a watcher has recognised: its kind, and its numbers in words.
struct Finding {
  AdviceKind kind;
  const BilingualText* what;  // {1}, {2}, {3}: the numbers; {command} and others: the command
  std::array<double, 3> numbers{};
  bool replaces_numbers = false;                       // later numbers replace the first
  const BilingualText* todo = nullptr;                 // null: text of the kind
  std::optional<std::uint8_t> command = std::nullopt;  // the command concerned
};
template <class... Numbers>
Finding finding(AdviceKind kind, const BilingualText& what, Numbers... numbers) {
  return {kind, &what, {static_cast<double>(numbers)...}};
}
/// Counts an event; returns true from number `limit` on.
inline bool reached(int& count, int limit) {
  count = std::min(count + 1, limit);
  return count == limit;
}

/// Returns true if drives of this generation have the command, in a series that supports it.
bool has(const protocol::GenerationRow& row, const protocol::CommandInfo& command,
         protocol::Framing framing);
/// Returns true if both findings are repetitions of one mistake.
bool same_cause(const Finding& one, const Finding& other);

/// A mistake of a host with a drive, and how often it was made.
struct Advice {
  Finding found;  // of the first time; for a rate, of the last
  int id = 0;     // the drive; 0: the whole bus
  std::uint64_t count = 0;
  SimTime first{0};
  protocol::Frame frame;  // first frame with the mistake
};

/// Returns the problem with the frame, numbers filled in.
std::string what_text(const Advice& advice, Language language);
/// Returns the remedy.
std::string todo_text(const Advice& advice, Language language);
/// Returns one line: "vcan0:1: rom-wear: … (12 times, first 141#32… at 0.25 s); todo".
std::string advice_line(const std::string& bus, const Advice& advice, Language language);

/// A frame that is wrong, or may turn out to be.
struct Suspect {
  std::uint64_t number = 0;  // of the frame; 0: none
  SimTime at{0};
  protocol::Frame frame;
};

/// List of findings, one for each cause and drive, and marks for the last wrong frames.
class AdviceLog {
 public:
  /// Limits for a bus, and for one kind and drive. Findings beyond are only counted.
  static constexpr std::size_t kMax = 1000;
  static constexpr std::size_t kMaxCauses = 16;  // assumed: a host with more scans
  static constexpr std::size_t kMarks = 1024;

  AdviceLog() : marks_(kMarks) {}
  void note(int id, const Finding& finding, const Suspect& suspect, std::uint64_t times = 1);
  const std::vector<Advice>& all() const { return all_; }
  std::string_view mark_of(std::uint64_t number) const;
  /// Number of findings without an entry.
  std::uint64_t left_out() const { return left_out_; }

 private:
  bool has_room(int id, AdviceKind kind) const;

  struct Mark {
    std::uint64_t number = 0;
    AdviceKind kind = AdviceKind::kRomWear;
  };
  std::vector<Advice> all_;
  std::uint64_t left_out_ = 0;
  std::vector<Mark> marks_;  // ring of the last kMarks, by number
};

}  // namespace lk::emulator
