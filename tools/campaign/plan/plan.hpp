#pragma once

/// @file The plan of a campaign (docs/campaigns.md) as plain values.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "model/setpoint.hpp"
#include "tools/campaign/plan/dimension_values.hpp"
#include "tools/campaign/results/case_result.hpp"

namespace lk::emulator {

struct FaultRow;

/// What a dimension changes of the base scenario.
enum class Target : std::uint8_t {
  kFaultKind,
  kFaultBus,  // where a robot has several
  kFaultId,
  kFaultAt,
  kFaultFor,
  kFaultProbability,
  kFaultParam,  // `kind` and `key`
  kSeed,
  kBitrate,
  kGeneration,
  kBusLoad,  // share of the wire that others take, with what loses to every drive
  kSupply,
  kAmbient,
  kLoad,  // `key`
  kHost,  // `key`: a setting of the host program
};

struct Dimension {
  std::string name;  // "fault.jam.percent"
  Target target = Target::kFaultKind;
  std::string kind;  // of kFaultParam: the fault that it is of
  std::string key;   // of kFaultParam, kLoad, kHost
  DimensionValues values;
  bool least_is_to = false;  // the harmless end
};

/// One condition of an exclusion: the dimension is one of `values`, or within the range.
struct ExcludedValues {
  std::size_t dimension = 0;
  std::vector<CaseValue> values;
  double from = 0, to = 0;  // when `values` is empty
};
/// Cases for which all of them fit are left out.
using Exclusion = std::vector<ExcludedValues>;

/// What a scripted host, one that does not react, would notice by: the scenario's [[expect]] words
/// of a reply, or that there is none.
struct HostRule {
  std::string toml;  // the keys of an [[expect]]: reply = {…}, or answered = {…}
  std::string text;  // for people
};

struct Detection {
  bool by_drive = true;
  std::vector<std::string> drive_errors;  // words; empty: any
  std::vector<HostRule> host;
  // Of a host program: lines of its output (ECMAScript), and how it exits.
  std::vector<std::string> lines;
  std::vector<int> exit_status;
};

/// A host program that is started for each case.
struct HostProgram {
  std::vector<std::string> command;  // {host.NAME}, {channel} and others are filled in
  std::string bus = "slcan-tcp";     // the kind of its bus
  bool stepped = false;
  double timeout_s = 60;
  int runs = 1;  // of each case in real time
};

struct Plan {
  CampaignHead head;
  std::filesystem::path file;           // the plan
  std::filesystem::path scenario_file;  // the base
  std::string scenario_text;
  std::vector<Dimension> dimensions;
  std::vector<Exclusion> exclusions;
  std::vector<std::string> hazards;  // `says` of expectations; empty: all
  Detection detection;
  std::optional<HostProgram> host;

  /// The dimension of this target; null: there is none.
  const Dimension* find(Target target) const;
};

/// The values of a case, by the plan's dimensions; nothing where a dimension does not count.
using CaseValues = std::vector<std::optional<CaseValue>>;

/// One text for each: no two have the same.
std::string key_of(const CaseValues& values);

/// Whether `dimension` counts in cases whose fault is of this kind; null: there is no fault.
bool applies(const Dimension& dimension, const FaultRow* kind);
/// The kind of fault of these values, as far as they go; null: the plan has no fault.
const FaultRow* kind_of(const Plan& plan, const CaseValues& values);
/// The value of each dimension that counts; the kind of fault is asked for first, as it decides
/// what does.
CaseValues values_by_kind(const Plan& plan, const std::function<CaseValue(std::size_t)>& value_of);
bool is_excluded(const Plan& plan, const CaseValues& values);

}  // namespace lk::emulator
