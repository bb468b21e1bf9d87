#pragma once

/// @file What a picture of a run shows: the one table behind it.

#include <span>
#include <string_view>

#include "emulator/ground/language.hpp"
#include "tools/plot/picture.hpp"

namespace lk::emulator {

/// A signal that a panel shows if the file has it.
struct PlotQuantity {
  std::string_view signal;
  Words label;
  LineStyle style;
  bool on_right_axis = false;
  std::string_view in_place_of = {};  // shown only if the file does not have this one
  /// An angle whose zero is arbitrary: begins where this signal does.
  std::string_view begins_with = {};
};

struct PlotSubject {
  Words name;
  Words left_axis;
  double left_span;  // at least so much is shown; assumed: what looks like noise otherwise
  Words right_axis;
  double right_span;
  std::span<const PlotQuantity> quantities;  // in the order of drawing
};

/// The panels from top to bottom.
std::span<const PlotSubject> plot_subjects();

}  // namespace lk::emulator
