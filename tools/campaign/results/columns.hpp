#pragma once

/// @file The columns of a case besides its number and its dimensions: once, for the schema, for
/// what is read and written, and for the canonical export.

#include "tools/campaign/results/case_result.hpp"

namespace lk::emulator {

/// Text of which there are few: stored once, in `words`. Empty is nothing.
template <class Text>
struct Word {
  Text& text;
};
template <class Text>
Word(Text&) -> Word<Text>;

/// Calls `visit(name, member)` for each, in order. Without what differs each time: the wall clock,
/// and the text of what the host said, in which there may be a time or a path.
template <class Result, class Visit>
void each_column(Result& result, Visit&& visit) {
  visit("outcome", result.outcome);
  // Not `generation`, which is a dimension: the generation of the drives.
  visit("adaptive_generation", result.generation);
  visit("fault_at_ns", result.fault_at);
  visit("first_effect_at_ns", result.first_effect_at);
  visit("detected_by_drive_ns", result.detected_by_drive);
  visit("detected_by_host_ns", result.detected_by_host);
  visit("violated_at_ns", result.violated_at);
  visit("violated", Word{result.violated});
  visit("margin", result.margin);
  visit("state", Word{result.state});
  visit("command", Word{result.command});
  visit("note", result.note);
  visit("real_time", result.real_time);
  visit("runs", result.runs);
  visit("flips", result.flips);
}

/// Their names and types alone.
template <class Visit>
void each_column(Visit&& visit) {
  const CaseResult none;
  each_column(none, visit);
}

}  // namespace lk::emulator
