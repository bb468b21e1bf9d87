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
  kLunge,
  kParameterSpace,
  kSettingNotSaved,
  kTtyNotRaw,
  kZeroWithoutPayload,
  kCanPadding,
  kTalksOverReply,
  kEchoTaken,
  kSumWrong,
  kCalibrationUnderLoad,
  kLeftTurning,
  kFirstTargetZero,
  kTargetWrapped,
  kAnswersShifted,
  kStaleBacklog,
};
inline constexpr std::size_t kAdviceKinds = static_cast<std::size_t>(AdviceKind::kStaleBacklog) + 1;

struct AdviceRow {
  AdviceKind kind;
  std::string_view word;  // name for programs; never changes
  BilingualText rule;     // condition, as in the documents
  BilingualText todo;
  bool is_per_cause = false;    // one advice per cause (same_cause), not per kind
  BilingualText serial_todo{};  // for RS-485, if `todo` is about CAN
};

/// All rows, in the order of AdviceKind.
std::span<const AdviceRow> advice_table();
const AdviceRow& advice_row(AdviceKind kind);

/// A mistake that a watcher has recognised: its kind, a description, and measured numbers.
struct Finding {
  AdviceKind kind;
  // {1} to {3} stand for `numbers`, {event} for `event`, {command}, {name}, … for `command`.
  const BilingualText* what;
  std::array<double, 3> numbers{};
  bool replaces_numbers = false;                       // later numbers replace the first
  const BilingualText* todo = nullptr;                 // remedy; null: that of the kind
  std::optional<std::uint8_t> command = std::nullopt;  // byte of the wrong command
  const BilingualText* event = nullptr;
};
template <class... Numbers>
Finding finding(AdviceKind kind, const BilingualText& what, Numbers... numbers) {
  return {kind, &what, {static_cast<double>(numbers)...}};
}
/// Increments `count`, at most to `limit`. Returns true from the `limit`th call on.
inline bool reached(int& count, int limit) {
  count = std::min(count + 1, limit);
  return count == limit;
}

/// Returns true if drives of generation `row` have the command by default. Ignores that some series
/// lack it.
bool has(const protocol::GenerationRow& row, const protocol::CommandInfo& command,
         protocol::Framing framing);
/// Returns true if both findings are repetitions of one mistake.
bool same_cause(const Finding& one, const Finding& other);

/// A mistake of a host with a drive, and how often it was made.
struct Advice {
  Finding found;  // first occurrence; last one if `replaces_numbers`
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

/// A host's frame that is wrong, or may turn out to be wrong.
struct Suspect {
  std::uint64_t number = 0;  // count of hosts' frames (Adviser::query_count); 0: no frame
  SimTime at{0};
  protocol::Frame frame;
};

/// List of advice, one entry for each cause and drive, and a mark for each recent wrong frame.
class AdviceLog {
 public:
  /// Limits of entries: kMax per bus, kMaxCauses per kind and drive. Further ones are only counted.
  static constexpr std::size_t kMax = 1000;
  static constexpr std::size_t kMaxCauses = 16;  // assumed: a host that exceeds it is scanning
  static constexpr std::size_t kMarks = 1024;

  AdviceLog() : marks_(kMarks) {}
  void note(int id, const Finding& finding, const Suspect& suspect, std::uint64_t times = 1);
  const std::vector<Advice>& all() const { return all_; }
  std::string_view mark_of(std::uint64_t number) const;
  /// Number of mistakes that got no entry because of the limits.
  std::uint64_t left_out() const { return left_out_; }

 private:
  bool has_room(int id, AdviceKind kind) const;

  struct Mark {
    std::uint64_t number = 0;
    AdviceKind kind = AdviceKind::kRomWear;
  };
  std::vector<Advice> all_;
  std::uint64_t left_out_ = 0;
  std::vector<Mark> marks_;  // mark of frame `number` is at number % kMarks
};

}  // namespace lk::emulator
