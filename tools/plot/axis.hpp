#pragma once

#include <string>

#include "tools/plot/picture.hpp"

namespace lk::emulator {

/// The smallest and the largest of the values that an axis has to show.
struct PlotRange {
  double low = 0;
  double high = 0;
  bool empty = true;

  void add(double value);
};

/// An axis of values with a margin and ticks at round values, `ticks` of them at most, give or take
/// one. It spans at least `least_span`, so that noise does not fill the picture; values that span
/// less are at this share of the height.
PlotAxis value_axis(std::string title, const PlotRange& range, double least_span, double share,
                    int ticks);

/// An axis of exactly the times that there are.
PlotAxis time_axis(std::string title, const PlotRange& range, int ticks);

}  // namespace lk::emulator
