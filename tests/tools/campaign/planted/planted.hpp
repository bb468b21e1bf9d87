#pragma once

/// @file Ten hosts with one bug each, planted for judging how a campaign is sampled: what a case
/// may vary, and what becomes of the joint in it.
///
/// How rare they are, by planted_sweep, all of the space equally likely:
///
///     bug                          margin leads there   fail of cases   one in
///     supervisor_counts_to_255     partly, sawteeth       10 of  4000    400
///     integral_winds_up            a ridge                13 of  3000    231
///     amperes_for_volts            smoothly               14 of  4000    286
///     back_off_too_far             in steps, by chance     9 of  3000    333
///     derated_to_nothing           a plateau, a slope     12 of  4500    375
///     differences_of_late_replies  smoothly               11 of  2500    227
///     docking_not_repeated         no                      7 of  5000    714
///     error_forgotten_in_homing    no                      6 of  4000    667
///     stale_standstill             no                     11 of  4000    364
///     turns_lost_on_the_move       no                      7 of  2400    343

#include <map>
#include <string>
#include <variant>
#include <vector>

#include "emulator/core/scenario/scenario.hpp"

namespace lk::emulator::planted {

/// What a case has of each dimension, by its name: a number or a word. What is not there stays as
/// the scenario, or the host, has it.
using Values = std::map<std::string, std::variant<double, std::string>>;

/// What a case may have: one of `words`, one of `numbers`, or anything in `from`..`to`, whichever
/// is there. All are equally likely, wherever in a range.
struct Dimension {
  std::string name;  // "fault.kind", "fault.jam.percent", "host.blocked_ms"
  std::vector<std::string> words = {};
  std::vector<double> numbers = {};
  double from = 0, to = 0;
  bool whole = false;  // of a range: takes no fractions
};

/// What came of a case.
struct PlantedRun {
  bool failed = false;  // something expected did not come about
  bool fired = false;   // the fault took effect
  // How far the worst of what is expected of a signal stood from its nearer bound, in widths of its
  // range: 0 at the bound, below it failed. 1 where nothing has a width.
  double margin = 1;
};

using HostValues = std::map<std::string, double>;  // "blocked_ms": 80

struct Bug {
  std::string name;
  std::string about;     // what is wrong with the host
  bool has_gradient;     // the margin of cases that pass tells where those are that fail
  std::string scenario;  // TOML; the robot's path is from this folder
  std::vector<Dimension> dimensions;
  PlantedRun (*run)(const Scenario& scenario, const HostValues& host);
};

/// A case that fails, found by trying, and a neighbour that does not.
struct KnownCase {
  std::string bug;
  Values fails;
  std::string moved;  // this dimension to
  double passes_at = 0;
};
std::vector<KnownCase> known_cases();

/// Those that the margin leads to, and those that it does not.
std::vector<Bug> bugs_with_gradient();
std::vector<Bug> bugs_without_gradient();
std::vector<Bug> all_bugs();

}  // namespace lk::emulator::planted
