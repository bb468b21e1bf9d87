#include "tools/plot/svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/ground/text.hpp"
#include "tools/plot/svg_text.hpp"

namespace lk::emulator {
namespace {

// Okabe and Ito, "Color Universal Design" (2008), without black and yellow.
constexpr std::array<unsigned, kPlotColours> kColours = {
    0x0072B2,  // blue
    0xD55E00,  // vermillion
    0x009E73,  // bluish green
    0xCC79A7,  // reddish purple
    0xE69F00,  // orange
    0x56B4E9,  // sky blue
};
constexpr unsigned kAnyDrive = 0x4D4D4D;

// DejaVu Sans and Verdana are as wide as is assumed (svg_text.hpp); the others have the Chinese
// characters on Linux, macOS and Windows.
constexpr std::string_view kFonts =
    "DejaVu Sans, Verdana, Noto Sans CJK SC, Noto Sans SC, WenQuanYi Micro Hei, PingFang SC, "
    "Microsoft YaHei, sans-serif";

// Everything in px of the picture.
constexpr double kWidth = 1100;
constexpr double kLeft = 80;
constexpr double kRight = kWidth - 80;
constexpr double kHeadHeight = 62;    // with one row of drives
constexpr double kDrivesHeight = 20;  // each row more
constexpr double kSubtitleHeight = 18;
constexpr double kPanelHeight = 190;
constexpr double kKeysHeight = 34;  // above each panel
constexpr double kFootHeight = 52;
constexpr double kMissingHeight = 22;  // below all others
constexpr double kTitleSize = 18;
constexpr double kTextSize = 12;
constexpr double kSwatch = 24;  // a drive's colour and the room behind it
constexpr double kSample = 36;  // a style's line and the room behind it
constexpr double kApart = 22;   // one entry of a legend and the next

/// To an eighth of a px, which keeps files small.
double rounded(double px) { return std::round(px * 8) / 8 + 0.0; }

/// Where a value is between two ends of the paper.
double place(double value, const PlotAxis& axis, double from, double to) {
  const double share = (value - axis.low) / (axis.high - axis.low);
  return rounded(from + share * (to - from));
}

std::string_view look_of(LineStyle style) {
  switch (style) {
    case LineStyle::kSolid:
      return R"(stroke-width="1.3")";
    case LineStyle::kDashed:
      return R"(stroke-width="1.3" stroke-dasharray="6 4")";
    case LineStyle::kDotted:
      return R"(stroke-width="1.3" stroke-dasharray="1.5 2.5")";
    case LineStyle::kDashDotted:
      return R"(stroke-width="1.3" stroke-dasharray="9 3 2 3")";
    case LineStyle::kBroad:
      return R"(stroke-width="5" stroke-opacity="0.3")";
  }
  return "";
}

/// What is dashed is half as bright, to be seen on the line that it is the reference of.
std::string stroke(LineStyle style, unsigned colour) {
  const unsigned shown = style == LineStyle::kDashed ? (colour >> 1U) & 0x7F7F7FU : colour;
  return fmt::format(R"(stroke="#{:06x}" {})", shown, look_of(style));
}

/// The size at which all labels of an axis fit into `room` px each.
double label_size(const PlotAxis& axis, double room) {
  double widest = room;
  for (const PlotTick& tick : axis.ticks) {
    widest = std::max(widest, assumed_width_px(tick.label, kTextSize));
  }
  return rounded(kTextSize * room / widest);
}

struct Spot {
  double x;
  double y;

  bool operator==(const Spot&) const = default;
};

/// Whether a line goes on from a to c through b without a turn. Exact, for eighths of a px.
bool straight(Spot a, Spot b, Spot c) {
  const Spot in{b.x - a.x, b.y - a.y};
  const Spot out{c.x - b.x, c.y - b.y};
  return in.x * out.y == in.y * out.x && in.x * out.x + in.y * out.y > 0;
}

/// Where the drives are named: in as many rows as it takes.
std::vector<Spot> places_of_drives(const Picture& picture) {
  std::vector<Spot> spots;
  Spot next{kLeft, 54.5};
  for (const std::string& drive : picture.drives) {
    const double width = kSwatch + assumed_width_px(drive, kTextSize);
    if (next.x > kLeft && next.x + width > kRight) next = {kLeft, next.y + kDrivesHeight};
    spots.push_back({rounded(next.x), next.y});
    next.x += width + kApart;
  }
  return spots;
}

double head_height(const Picture& picture) {
  const std::vector<Spot> drives = places_of_drives(picture);
  const double more_rows = drives.empty() ? 0 : drives.back().y - drives.front().y;
  return kHeadHeight + more_rows + (picture.subtitle.empty() ? 0 : kSubtitleHeight);
}

double picture_height(const Picture& picture) {
  double height = head_height(picture) + kFootHeight;
  for (const PlotPanel& panel : picture.panels) {
    height += panel.missing.empty() ? kKeysHeight + kPanelHeight : kMissingHeight;
  }
  return height;
}

/// For those who do not see the picture: drives and panels.
std::string description(const Picture& picture) {
  std::string text;
  for (const std::string& drive : picture.drives) text += (text.empty() ? "" : ", ") + drive;
  for (const PlotPanel& panel : picture.panels) {
    text += (text.empty() ? "" : "; ");
    if (!panel.missing.empty()) text += panel.missing;
    if (panel.left) text += panel.left->title;
    if (panel.left && panel.right) text += ", ";
    if (panel.right) text += panel.right->title;
  }
  return text;
}

class Drawing {
 public:
  explicit Drawing(const Picture& picture) : picture_(picture) {}

  std::string draw() {
    const double height = picture_height(picture_);
    put(R"(<?xml version="1.0" encoding="UTF-8"?>)"
        "\n"
        R"(<svg xmlns="http://www.w3.org/2000/svg" width="{0}" height="{1}" viewBox="0 0 {0} {1}")"
        R"( role="img" xml:lang="{2}" font-family="{3}" font-size="{4}" fill="#222">)"
        "\n<title>{5}</title>\n<desc>{6}</desc>\n",
        kWidth, height, picture_.language == Language::kChinese ? "zh-Hans" : "en", kFonts,
        kTextSize, xml_escaped(on_one_line(picture_.title)),
        xml_escaped(on_one_line(description(picture_))));
    put("<rect width=\"{}\" height=\"{}\" fill=\"#fff\"/>\n", kWidth, height);
    draw_head();
    double top = head_height(picture_);
    for (const PlotPanel& panel : picture_.panels) {
      if (!panel.missing.empty()) continue;
      draw_panel(panel, top + kKeysHeight);
      top += kKeysHeight + kPanelHeight;
    }
    if (top > head_height(picture_)) draw_times(top);
    top += kFootHeight;
    for (const PlotPanel& panel : picture_.panels) {
      if (panel.missing.empty()) continue;
      write(panel.missing, {kLeft, top + 6});
      top += kMissingHeight;
    }
    put("</svg>\n");
    return std::move(svg_);
  }

 private:
  template <class... T>
  void put(fmt::format_string<T...> format, T&&... values) {
    fmt::format_to(std::back_inserter(svg_), format, std::forward<T>(values)...);
  }

  /// `look`: more attributes, with a space before each.
  void write(const std::string& text, Spot at, std::string_view look = "") {
    put("<text x=\"{}\" y=\"{}\"{}>{}</text>\n", at.x, at.y, look, xml_escaped(on_one_line(text)));
  }

  /// As large as fits across the picture.
  void write_fitted(const std::string& text, Spot at, double size) {
    const FittedText fitted = fit_text(text, size, kRight - kLeft);
    write(fitted.text, at, fmt::format(" font-size=\"{}\"", rounded(fitted.size_px)));
  }

  void draw_head() {
    write_fitted(picture_.title, {kLeft, 30}, kTitleSize);
    const std::vector<Spot> spots = places_of_drives(picture_);
    put("<g class=\"drives\">\n");
    for (std::size_t n = 0; n < spots.size(); ++n) {
      put("<rect x=\"{}\" y=\"{}\" width=\"18\" height=\"8\" fill=\"#{:06x}\"/>\n", spots[n].x,
          spots[n].y - 8.5, kColours[n]);
      write(picture_.drives[n], {spots[n].x + kSwatch, spots[n].y});
    }
    put("</g>\n");
    if (!picture_.subtitle.empty()) {
      write_fitted(picture_.subtitle, {kLeft, head_height(picture_) - 5}, 11);
    }
  }

  void draw_times(double top) {
    const auto apart = static_cast<double>(std::max<std::size_t>(picture_.time.ticks.size(), 1));
    put("<g class=\"times\" text-anchor=\"middle\" font-size=\"{}\">\n",
        label_size(picture_.time, (kRight - kLeft) / apart - 10));
    for (const PlotTick& tick : picture_.time.ticks) {
      write(tick.label, {place(tick.value, picture_.time, kLeft, kRight), top + 19});
    }
    put("</g>\n");
    write(picture_.time.title, {(kLeft + kRight) / 2, top + 40}, " text-anchor=\"middle\"");
  }

  void draw_panel(const PlotPanel& panel, double top) {
    const double bottom = top + kPanelHeight;
    put("<g class=\"panel\">\n");
    draw_keys(panel, top - 9);
    draw_grid(panel, top, bottom);
    if (panel.left) draw_axis(*panel.left, top, bottom, -1);
    if (panel.right) draw_axis(*panel.right, top, bottom, 1);
    for (const PlotLine& line : panel.lines) {
      const auto& axis = line.on_right_axis ? panel.right : panel.left;
      if (axis) draw_line(line, *axis, top, bottom);
    }
    draw_frame(top, bottom);
    put("</g>\n");
  }

  void draw_keys(const PlotPanel& panel, double y) {
    double x = kLeft;
    put("<g class=\"keys\">\n");
    for (const PlotKey& key : panel.keys) {
      const unsigned colour =
          key.colour ? kColours[static_cast<std::size_t>(*key.colour)] : kAnyDrive;
      put("<path d=\"M{},{}h30\" {}/>\n", x, y - 4, stroke(key.style, colour));
      write(key.label, {x + kSample, y});
      x = rounded(x + kSample + assumed_width_px(key.label, kTextSize) + kApart);
    }
    put("</g>\n");
  }

  void draw_grid(const PlotPanel& panel, double top, double bottom) {
    put(R"(<path class="grid" stroke="#e0e0e0" shape-rendering="crispEdges" d=")");
    for (const PlotTick& tick : picture_.time.ticks) {
      put("M{},{}V{}", place(tick.value, picture_.time, kLeft, kRight), top, bottom);
    }
    const PlotAxis& axis = panel.left ? *panel.left : *panel.right;
    for (const PlotTick& tick : axis.ticks) {
      put("M{},{}H{}", kLeft, place(tick.value, axis, bottom, top), kRight);
    }
    put("\"/>\n");
  }

  /// `outwards`: -1 at the left edge of the panel, 1 at the right one.
  void draw_axis(const PlotAxis& axis, double top, double bottom, int outwards) {
    constexpr double kRoom = 50;  // between the title and the ticks
    const double x = outwards < 0 ? kLeft : kRight;
    put(R"(<path stroke="#8c8c8c" shape-rendering="crispEdges" d=")");
    for (const PlotTick& tick : axis.ticks) {
      put("M{},{}h{}", x, place(tick.value, axis, bottom, top), outwards * 5);
    }
    put("\"/>\n<g class=\"values\" text-anchor=\"{}\" font-size=\"{}\">\n",
        outwards < 0 ? "end" : "start", label_size(axis, kRoom));
    for (const PlotTick& tick : axis.ticks) {
      write(tick.label, {x + outwards * 9, place(tick.value, axis, bottom, top) + 4});
    }
    put("</g>\n");
    const Spot middle{outwards < 0 ? 15 : kWidth - 6, (top + bottom) / 2};
    write(
        axis.title, middle,
        fmt::format(" text-anchor=\"middle\" transform=\"rotate(-90 {} {})\"", middle.x, middle.y));
  }

  /// Without those that fall on the one before them, or on the straight way to the next one.
  std::vector<Spot> spots_of(const std::vector<PlotPoint>& run, const PlotAxis& axis, double top,
                             double bottom) const {
    std::vector<Spot> spots;
    for (const PlotPoint& point : run) {
      const Spot spot{place(point.time_s, picture_.time, kLeft, kRight),
                      place(point.value, axis, bottom, top)};
      if (!spots.empty() && spot == spots.back()) continue;
      if (spots.size() > 1 && straight(spots[spots.size() - 2], spots.back(), spot))
        spots.pop_back();
      spots.push_back(spot);
    }
    return spots;
  }

  void draw_line(const PlotLine& line, const PlotAxis& axis, double top, double bottom) {
    const unsigned colour = kColours[static_cast<std::size_t>(line.colour)];
    std::string path;
    std::vector<Spot> dots;
    for (const auto& run : line.runs) {
      const std::vector<Spot> spots = spots_of(run, axis, top, bottom);
      if (spots.size() == 1) {
        dots.push_back(spots.front());
        continue;
      }
      path += 'M';
      for (const Spot& spot : spots) {
        fmt::format_to(std::back_inserter(path), "{}{},{}", &spot == spots.data() ? "" : " ",
                       spot.x, spot.y);
      }
    }
    put("<g class=\"trace\" {}>\n", stroke(line.style, colour));
    if (!path.empty()) put("<path fill=\"none\" stroke-linejoin=\"round\" d=\"{}\"/>\n", path);
    for (const Spot& dot : dots) {
      put("<circle cx=\"{}\" cy=\"{}\" r=\"2\" fill=\"#{:06x}\" stroke=\"none\"/>\n", dot.x, dot.y,
          colour);
    }
    put("</g>\n");
  }

  void draw_frame(double top, double bottom) {
    put(R"(<path class="frame" fill="none" stroke="#8c8c8c" shape-rendering="crispEdges")"
        R"( d="M{0},{1}H{2}V{3}H{0}Z)",
        kLeft, top, kRight, bottom);
    for (const PlotTick& tick : picture_.time.ticks) {
      put("M{},{}v4", place(tick.value, picture_.time, kLeft, kRight), bottom);
    }
    put("\"/>\n");
  }

  const Picture& picture_;
  std::string svg_;
};

}  // namespace

std::string to_svg(const Picture& picture) { return Drawing(picture).draw(); }

}  // namespace lk::emulator
