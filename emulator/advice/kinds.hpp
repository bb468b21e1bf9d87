#pragma once

/// @file Mistakes of hosts, one row for each kind (docs/advice.md).

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "emulator/ground/language.hpp"

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
  Words rule;             // condition, as in the documents
  Words todo;
  bool apiece = false;  // one advice for each cause
  Words serial_todo{};  // for RS-485, if `todo` is about CAN
};

/// All rows, in the order of AdviceKind.
std::span<const AdviceRow> advice_table();
const AdviceRow& advice_row(AdviceKind kind);

}  // namespace lk::emulator
