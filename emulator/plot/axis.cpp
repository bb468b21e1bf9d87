#include "emulator/plot/axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace lk::emulator {
namespace {

/// The least span of an axis on which labels of ten digits can be told apart.
double resolution(const PlotRange& range) {
  return 1e-7 * std::max(std::abs(range.low), std::abs(range.high));
}

/// 1, 2 or 5 times a power of ten.
double round_step(double roughly) {
  const double power = std::pow(10.0, std::floor(std::log10(roughly)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (roughly <= factor * power * (1 + 1e-9)) return factor * power;
  }
  return 10 * power;
}

/// With as many decimals as the step has.
std::string tick_label(double value, double step) {
  if (std::abs(value) >= 1e7 || step < 1e-6) return fmt::format("{:.10g}", value);
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  const std::string text = fmt::format("{:.{}f}", value, decimals);
  // A minus as long as the digits are wide; a hyphen is easily overlooked.
  return text.starts_with('-') ? "\u2212" + text.substr(1) : text;
}

PlotAxis make_axis(std::string title, double low, double high, int ticks) {
  PlotAxis axis{std::move(title), low, high, {}};
  const double step = round_step((high - low) / ticks);
  const double first = std::ceil(low / step - 1e-9);
  for (int k = 0; (first + k) * step <= high + 1e-9 * step; ++k) {
    const double value = (first + k) * step + 0.0;  // no minus before a zero
    axis.ticks.push_back({value, tick_label(value, step)});
  }
  return axis;
}

}  // namespace

void PlotRange::add(double value) {
  low = empty ? value : std::min(low, value);
  high = empty ? value : std::max(high, value);
  empty = false;
}

PlotAxis value_axis(std::string title, const PlotRange& range, double least_span, double share,
                    int ticks) {
  constexpr double kMargin = 0.06;
  const double least = std::max(least_span, resolution(range));
  const double span = range.high - range.low;
  const double spare = std::max(least - span, 0.0);
  const double margin = kMargin * (span + spare);
  return make_axis(std::move(title), range.low - spare * share - margin,
                   range.high + spare * (1 - share) + margin, ticks);
}

PlotAxis time_axis(std::string title, const PlotRange& range, int ticks) {
  constexpr double kInstant_s = 1e-9;  // times are said to the nanosecond
  const double span = range.high - range.low;
  if (span > std::max(kInstant_s, resolution(range)))
    return make_axis(std::move(title), range.low, range.high, ticks);
  const double around = std::max(0.5, resolution(range));
  return make_axis(std::move(title), range.low - around, range.high + around, ticks);
}

}  // namespace lk::emulator
