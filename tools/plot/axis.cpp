#include "tools/plot/axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

namespace lk::emulator {
namespace {

/// The least span of an axis on which labels of ten digits can be told apart.
double resolution(const PlotRange& range) {
  return 1e-7 * std::max(std::abs(range.low), std::abs(range.high));
}

/// factor * 10^exponent. Powers and logarithms of the C library differ between machines in their
/// last bit, so they are left to decimal text, which is rounded correctly everywhere.
struct Step {
  int factor;  // 1, 2 or 5
  int exponent;

  double value() const {
    const std::string text = fmt::format("{}e{}", factor, exponent);
    double value = 0;
    std::from_chars(text.data(), text.data() + text.size(), value);
    return value;
  }
};

/// The next larger of 1, 2 or 5 times a power of ten.
Step round_step(double roughly) {
  // 17 digits are never rounded up to the next power.
  const std::string text = fmt::format("{:.16e}", roughly);
  const int exponent = std::stoi(text.substr(text.find('e') + 1));
  for (const int factor : {1, 2, 5}) {
    const Step step{factor, exponent};
    if (roughly <= step.value() * (1 + 1e-9)) return step;
  }
  return {1, exponent + 1};
}

/// With as many decimals as the step has.
std::string tick_label(double value, const Step& step) {
  const bool plain = std::abs(value) < 1e7 && step.exponent >= -6;
  std::string text = plain ? fmt::format("{:.{}f}", value, std::max(0, -step.exponent))
                           : fmt::format("{:.10g}", value);
  // A minus as long as the digits are wide; a hyphen is easily overlooked.
  return text.starts_with('-') ? "\u2212" + text.substr(1) : text;
}

PlotAxis make_axis(std::string title, double low, double high, int ticks) {
  PlotAxis axis{std::move(title), low, high, {}};
  const Step round = round_step((high - low) / ticks);
  const double step = round.value();
  const double first = std::ceil(low / step - 1e-9);
  for (int k = 0; (first + k) * step <= high + 1e-9 * step; ++k) {
    const double value = (first + k) * step + 0.0;  // no minus before a zero
    axis.ticks.push_back({value, tick_label(value, round)});
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
