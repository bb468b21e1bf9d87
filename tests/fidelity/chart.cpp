#include "tests/fidelity/chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace lk::test {
namespace {

constexpr double kPanelWidth = 270, kPanelHeight = 200;  // px
constexpr double kLeft = 46, kTop = 40, kRight = 14, kBottom = 34;
constexpr double kHead = 44;
constexpr const char* kEmulated = "#0072B2";
constexpr const char* kReal = "#D55E00";

struct Range {
  double low = 0, high = 0;
};

std::string print(const char* format, ...) __attribute__((format(printf, 1, 2)));
std::string print(const char* format, ...) {
  std::array<char, 512> text{};
  std::va_list values;
  va_start(values, format);
  std::vsnprintf(text.data(), text.size(), format, values);
  va_end(values);
  return text.data();
}

/// Returns a step of 1, 2 or 5 times a power of ten that fits three to seven times.
double tick_step(const Range& range) {
  const double rough = (range.high - range.low) / 4;
  const double power = std::pow(10, std::floor(std::log10(rough)));
  const double times = rough / power;
  return power * (times < 1.5 ? 1 : times < 3.5 ? 2 : times < 7.5 ? 5 : 10);
}

Range range_of(const Panel& panel, double std::pair<double, double>::*side) {
  Range range;
  for (const Panel::Line& line : panel.lines) {
    for (const auto& point : line.points) {
      range.low = std::min(range.low, point.*side);
      range.high = std::max(range.high, point.*side);
    }
  }
  range.high += 0.06 * (range.high - range.low);
  if (range.low < 0) range.low -= 0.06 * (range.high - range.low);
  return range;
}

class Drawing {
 public:
  Drawing(const Panel& panel, double left, double top)
      : x_(range_of(panel, &std::pair<double, double>::first)),
        y_(range_of(panel, &std::pair<double, double>::second)),
        x_name_(panel.x),
        left_(left + kLeft),
        top_(top + kTop) {
    text(left_, top + 16, "start", "13", panel.title);
    text(left_ + kWidth, top_ + kHeight + 28, "end", "10", panel.x);
    text(left_ - 40, top + 32, "start", "10", panel.y);
    axes();
    for (const Panel::Line& line : panel.lines) draw(line);
  }
  const std::string& svg() const { return svg_; }

 private:
  static constexpr double kWidth = kPanelWidth - kLeft - kRight;
  static constexpr double kHeight = kPanelHeight - kTop - kBottom;

  double px(double x) const { return left_ + (x - x_.low) / (x_.high - x_.low) * kWidth; }
  double py(double y) const { return top_ + (y_.high - y) / (y_.high - y_.low) * kHeight; }

  void text(double x, double y, const char* anchor, const char* size, const std::string& what) {
    svg_ +=
        print(R"(<text x="%.1f" y="%.1f" text-anchor="%s" font-size="%s">)", x, y, anchor, size) +
        what + "</text>\n";
  }
  void axes() {
    if (!x_name_.empty()) x_axis();
    const double y_step = tick_step(y_);
    for (double y = std::ceil(y_.low / y_step) * y_step; y <= y_.high; y += y_step) {
      svg_ += print(R"(<path class="grid" d="M%.1f %.1fH%.1f"/>)"
                    "\n",
                    left_, py(y), left_ + kWidth);
      text(left_ - 5, py(y) + 3.5, "end", "10", print("%g", std::round(y * 1e6) / 1e6 + 0.0));
    }
  }
  void x_axis() {
    const double step = tick_step(x_);
    for (double x = std::ceil(x_.low / step) * step; x <= x_.high; x += step) {
      svg_ += print(R"(<path class="grid" d="M%.1f %.1fV%.1f"/>)"
                    "\n",
                    px(x), top_, top_ + kHeight);
      text(px(x), top_ + kHeight + 14, "middle", "10",
           print("%g", std::round(x * 1e6) / 1e6 + 0.0));
    }
  }
  void draw(const Panel::Line& line) {
    const char* colour = line.real ? kReal : kEmulated;
    if (line.marks) {
      for (const auto& [x, y] : line.points) {
        svg_ += print(R"(<circle cx="%.1f" cy="%.1f" r="4" fill="%s"/>)"
                      "\n",
                      px(x), py(y), colour);
      }
      return;
    }
    std::string path;
    for (const auto& [x, y] : line.points) {
      path += print("%s%.1f %.1f", path.empty() ? "M" : "L", px(x), py(y));
    }
    svg_ += print(R"(<path fill="none" stroke="%s" stroke-width="%s" d=")", colour,
                  line.real ? "2" : "1.2") +
            path + "\"/>\n";
  }

  Range x_, y_;
  std::string x_name_;
  double left_, top_;
  std::string svg_;
};

}  // namespace

std::string chart(const std::string& title, const std::vector<Panel>& panels, std::size_t columns) {
  const std::size_t rows = (panels.size() + columns - 1) / columns;
  const double width = kPanelWidth * static_cast<double>(columns);
  const double height = kHead + kPanelHeight * static_cast<double>(rows);
  std::string svg = print(
      R"(<svg xmlns="http://www.w3.org/2000/svg" width="%.0f" height="%.0f" viewBox="0 0 %.0f %.0f" font-family="DejaVu Sans, Verdana, sans-serif">)",
      width, height, width, height);
  svg += "\n<title>" + title + "</title>\n<style>.grid{stroke:#ddd}</style>\n";
  svg += R"(<rect width="100%" height="100%" fill="#fff"/>)"
         "\n";
  svg += R"(<text x="16" y="26" font-size="16">)" + title + "</text>\n";
  svg +=
      print(
          R"(<text x="%.0f" y="26" text-anchor="end" font-size="12"><tspan fill="%s">emulated</tspan> <tspan fill="%s">real, or printed</tspan></text>)",
          width - 16, kEmulated, kReal) +
      "\n";
  for (std::size_t n = 0; n < panels.size(); ++n) {
    svg += Drawing(panels[n], kPanelWidth * static_cast<double>(n % columns),
                   kHead + kPanelHeight * static_cast<double>(n / columns))
               .svg();
  }
  return svg + "</svg>\n";
}

}  // namespace lk::test
