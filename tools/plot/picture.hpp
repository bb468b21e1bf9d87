#pragma once

/// @file A picture of a run, before it is drawn: plain values.

#include <optional>
#include <string>
#include <vector>

#include "emulator/ground/language.hpp"

namespace lk::emulator {

enum class LineStyle { kSolid, kDashed, kDotted, kDashDotted, kBroad };

/// A value at a time, in the units of its axes.
struct PlotPoint {
  double time_s;
  double value;
};

/// A number of a palette that the drawing knows; the colour-blind can tell them apart, too.
inline constexpr int kPlotColours = 6;

struct PlotLine {
  int colour = 0;
  LineStyle style = LineStyle::kSolid;
  bool on_right_axis = false;
  std::vector<std::vector<PlotPoint>> runs;  // between them there is nothing to show
};

struct PlotTick {
  double value;
  std::string label;
};

struct PlotAxis {
  std::string title;
  double low = 0;
  double high = 1;
  std::vector<PlotTick> ticks;
};

struct PlotKey {
  std::string label;
  LineStyle style = LineStyle::kSolid;
  std::optional<int> colour;  // where colours do not stand for drives
};

struct PlotPanel {
  std::optional<PlotAxis> left;
  std::optional<PlotAxis> right;
  std::vector<PlotKey> keys;  // what a style stands for
  std::vector<PlotLine> lines;
  std::string missing;  // in place of all this
};

struct Picture {
  Language language = Language::kEnglish;
  std::string title;
  std::string subtitle;
  std::vector<std::string> drives;  // by colour
  PlotAxis time;
  std::vector<PlotPanel> panels;
};

}  // namespace lk::emulator
