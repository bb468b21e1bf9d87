// The module that draws (draw_module.hpp): one drawing for SVG and PNG.

#include <cairo-svg.h>
#include <cairo.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "emulator/plot/draw_module.hpp"
#include "emulator/plot/font.hpp"

namespace lk::emulator {
namespace {

struct Colour {
  double red, green, blue;
};

// Okabe and Ito, "Color Universal Design" (2008), without black and yellow.
constexpr std::array<Colour, kPlotColours> kColours = {{
    {0x00 / 255.0, 0x72 / 255.0, 0xB2 / 255.0},  // blue
    {0xD5 / 255.0, 0x5E / 255.0, 0x00 / 255.0},  // vermillion
    {0x00 / 255.0, 0x9E / 255.0, 0x73 / 255.0},  // bluish green
    {0xCC / 255.0, 0x79 / 255.0, 0xA7 / 255.0},  // reddish purple
    {0xE6 / 255.0, 0x9F / 255.0, 0x00 / 255.0},  // orange
    {0x56 / 255.0, 0xB4 / 255.0, 0xE9 / 255.0},  // sky blue
}};
constexpr Colour kInk = {0.13, 0.13, 0.13};
constexpr Colour kFrame = {0.55, 0.55, 0.55};
constexpr Colour kGrid = {0.88, 0.88, 0.88};

// Everything in points of the picture, which are the pixels of the SVG.
constexpr double kWidth = 1100;
constexpr double kLeft = 80;
constexpr double kRight = kWidth - 80;
constexpr double kPanelHeight = 190;
constexpr double kKeysHeight = 34;  // above each panel
constexpr double kFootHeight = 52;
constexpr double kMissingHeight = 22;  // below all others
constexpr double kPngScale = 2;
constexpr double kTextSize = 12;

double head_height(const Picture& picture) { return picture.subtitle.empty() ? 62 : 80; }

double picture_height(const Picture& picture) {
  double height = head_height(picture) + kFootHeight;
  for (const PlotPanel& panel : picture.panels) {
    height += panel.missing.empty() ? kKeysHeight + kPanelHeight : kMissingHeight;
  }
  return height;
}

/// Where a value is between two ends of the paper; to an eighth of a point, which keeps files
/// small.
double place(double value, const PlotAxis& axis, double from, double to) {
  const double share = (value - axis.low) / (axis.high - axis.low);
  return std::round((from + share * (to - from)) * 8) / 8;
}

class Drawing {
 public:
  Drawing(cairo_t* cairo, const Picture& picture) : cairo_(cairo), picture_(picture) {}

  void draw() {
    set_colour({1, 1, 1});
    cairo_paint(cairo_);
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
      write(panel.missing, kLeft, top + 6, 0);
      top += kMissingHeight;
    }
  }

 private:
  void set_colour(Colour colour, double opacity = 1) {
    cairo_set_source_rgba(cairo_, colour.red, colour.green, colour.blue, opacity);
  }

  double width_of(const std::string& text, double size = kTextSize) {
    cairo_set_font_size(cairo_, size);
    cairo_text_extents_t extents;
    cairo_text_extents(cairo_, text.c_str(), &extents);
    return extents.x_advance;
  }

  /// `anchor`: 0 begins at x, 0.5 has its middle there, 1 ends there.
  void write(const std::string& text, double x, double y, double anchor, double size = kTextSize) {
    cairo_move_to(cairo_, x - anchor * width_of(text, size), y);
    set_colour(kInk);
    cairo_show_text(cairo_, text.c_str());
  }

  void write_upwards(const std::string& text, double x, double middle_y) {
    cairo_save(cairo_);
    cairo_translate(cairo_, x, middle_y);
    cairo_rotate(cairo_, -std::acos(0.0));
    write(text, 0, 0, 0.5);
    cairo_restore(cairo_);
  }

  void set_style(LineStyle style, Colour colour) {
    const Colour dark = {colour.red * 0.5, colour.green * 0.5, colour.blue * 0.5};
    const bool reference = style == LineStyle::kDashed;
    set_colour(reference ? dark : colour, style == LineStyle::kBroad ? 0.3 : 1);
    cairo_set_line_width(cairo_, style == LineStyle::kBroad ? 5 : 1.3);
    constexpr std::array kDashes = {6.0, 4.0};
    constexpr std::array kDots = {1.5, 2.5};
    constexpr std::array kDashDots = {9.0, 3.0, 2.0, 3.0};
    if (style == LineStyle::kDashed) {
      cairo_set_dash(cairo_, kDashes.data(), kDashes.size(), 0);
    } else if (style == LineStyle::kDotted) {
      cairo_set_dash(cairo_, kDots.data(), kDots.size(), 0);
    } else if (style == LineStyle::kDashDotted) {
      cairo_set_dash(cairo_, kDashDots.data(), kDashDots.size(), 0);
    } else {
      cairo_set_dash(cairo_, nullptr, 0, 0);
    }
  }

  void draw_times(double top) {
    for (const PlotTick& tick : picture_.time.ticks) {
      write(tick.label, place(tick.value, picture_.time, kLeft, kRight), top + 19, 0.5);
    }
    write(picture_.time.title, (kLeft + kRight) / 2, top + 40, 0.5);
  }

  void draw_head() {
    constexpr double kTitleSize = 18;
    const double fits = (kRight - kLeft) / std::max(width_of(picture_.title, kTitleSize), 1.0);
    write(picture_.title, kLeft, 30, 0, kTitleSize * std::min(1.0, fits));
    double wide = 0;
    for (const auto& drive : picture_.drives) wide += 24 + width_of(drive) + 22;
    const double shrink = std::min(1.0, (kRight - kLeft) / std::max(wide, 1.0));
    double x = kLeft;
    for (std::size_t n = 0; n < picture_.drives.size(); ++n) {
      set_colour(kColours[n]);
      cairo_rectangle(cairo_, x, 46, 18 * shrink, 8);
      cairo_fill(cairo_);
      write(picture_.drives[n], x + 24 * shrink, 54.5, 0, kTextSize * shrink);
      x += shrink * (24 + width_of(picture_.drives[n]) + 22);
    }
    if (!picture_.subtitle.empty()) write(picture_.subtitle, kLeft, 75, 0, 11);
  }

  void draw_keys(const PlotPanel& panel, double y) {
    double x = kLeft;
    for (const PlotKey& key : panel.keys) {
      constexpr Colour kAnyDrive = {0.3, 0.3, 0.3};
      set_style(key.style,
                key.colour ? kColours[static_cast<std::size_t>(*key.colour)] : kAnyDrive);
      cairo_move_to(cairo_, x, y - 4);
      cairo_line_to(cairo_, x + 30, y - 4);
      cairo_stroke(cairo_);
      write(key.label, x + 36, y, 0);
      x += 36 + width_of(key.label) + 22;
    }
  }

  void set_thin(Colour colour) {
    set_colour(colour);
    cairo_set_line_width(cairo_, 1);
    cairo_set_dash(cairo_, nullptr, 0, 0);
    cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_BUTT);
  }

  void line(double x1, double y1, double x2, double y2) {
    cairo_move_to(cairo_, x1, y1);
    cairo_line_to(cairo_, x2, y2);
  }

  void draw_grid(const PlotPanel& panel, double top, double bottom) {
    set_thin(kGrid);
    for (const PlotTick& tick : picture_.time.ticks) {
      const double x = place(tick.value, picture_.time, kLeft, kRight);
      line(x, top, x, bottom);
    }
    const PlotAxis& axis = panel.left ? *panel.left : *panel.right;
    for (const PlotTick& tick : axis.ticks) {
      const double y = place(tick.value, axis, bottom, top);
      line(kLeft, y, kRight, y);
    }
    cairo_stroke(cairo_);
  }

  /// `outwards`: -1 at the left edge of the panel, 1 at the right one.
  void draw_axis(const PlotAxis& axis, double top, double bottom, double outwards) {
    constexpr double kRoom = 50;  // between the title and the ticks
    const double x = outwards < 0 ? kLeft : kRight;
    double widest = kRoom;
    for (const PlotTick& tick : axis.ticks) widest = std::max(widest, width_of(tick.label));
    for (const PlotTick& tick : axis.ticks) {
      const double y = place(tick.value, axis, bottom, top);
      set_thin(kFrame);
      line(x, y, x + outwards * 5, y);
      cairo_stroke(cairo_);
      write(tick.label, x + outwards * 9, y + 4, outwards < 0 ? 1 : 0, kTextSize * kRoom / widest);
    }
    write_upwards(axis.title, outwards < 0 ? 15 : kWidth - 6, (top + bottom) / 2);
  }

  void draw_frame(double top, double bottom) {
    set_thin(kFrame);
    cairo_rectangle(cairo_, kLeft, top, kRight - kLeft, bottom - top);
    for (const PlotTick& tick : picture_.time.ticks) {
      const double x = place(tick.value, picture_.time, kLeft, kRight);
      line(x, bottom, x, bottom + 4);
    }
    cairo_stroke(cairo_);
  }

  void draw_line(const PlotLine& drawn, const PlotAxis& axis, double top, double bottom) {
    set_style(drawn.style, kColours[static_cast<std::size_t>(drawn.colour)]);
    cairo_set_line_join(cairo_, CAIRO_LINE_JOIN_ROUND);
    for (const auto& run : drawn.runs) {
      // A point alone is a dot, which round ends make of it.
      cairo_set_line_cap(cairo_, run.size() == 1 ? CAIRO_LINE_CAP_ROUND : CAIRO_LINE_CAP_BUTT);
      if (run.size() == 1) cairo_set_dash(cairo_, nullptr, 0, 0);
      double last_x = -1;
      double last_y = -1;
      for (const PlotPoint& point : run) {
        const double x = place(point.time_s, picture_.time, kLeft, kRight);
        const double y = place(point.value, axis, bottom, top);
        if (last_x < 0) cairo_move_to(cairo_, x, y);
        if (last_x < 0 || x != last_x || y != last_y) cairo_line_to(cairo_, x, y);
        last_x = x;
        last_y = y;
      }
      cairo_stroke(cairo_);
      if (run.size() == 1) set_style(drawn.style, kColours[static_cast<std::size_t>(drawn.colour)]);
    }
  }

  void draw_panel(const PlotPanel& panel, double top) {
    const double bottom = top + kPanelHeight;
    draw_keys(panel, top - 9);
    draw_grid(panel, top, bottom);
    if (panel.left) draw_axis(*panel.left, top, bottom, -1);
    if (panel.right) draw_axis(*panel.right, top, bottom, 1);
    for (const PlotLine& drawn : panel.lines) {
      const auto& axis = drawn.on_right_axis ? panel.right : panel.left;
      if (axis) draw_line(drawn, *axis, top, bottom);
    }
    draw_frame(top, bottom);
  }

  cairo_t* cairo_;
  const Picture& picture_;
};

/// All that is written in a picture.
std::string all_text(const Picture& picture) {
  std::string text = picture.title + picture.subtitle + picture.time.title;
  const auto add_ticks = [&text](const PlotAxis& axis) {
    text += axis.title;
    for (const PlotTick& tick : axis.ticks) text += tick.label;
  };
  for (const std::string& drive : picture.drives) text += drive;
  add_ticks(picture.time);
  for (const PlotPanel& panel : picture.panels) {
    text += panel.missing;
    if (panel.left) add_ticks(*panel.left);
    if (panel.right) add_ticks(*panel.right);
    for (const PlotKey& key : panel.keys) text += key.label;
  }
  return text;
}

void check(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS) throw std::runtime_error(cairo_status_to_string(status));
}

cairo_status_t append(void* file, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(file)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;

Surface make_surface(const Picture& picture, PictureFormat format, std::string& file) {
  const double height = picture_height(picture);
  if (format == PictureFormat::kPng) {
    return {cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(kWidth * kPngScale),
                                       static_cast<int>(height * kPngScale)),
            cairo_surface_destroy};
  }
  Surface surface(cairo_svg_surface_create_for_stream(append, &file, kWidth, height),
                  cairo_surface_destroy);
  cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_PX);
  return surface;
}

std::string draw(const Picture& picture, PictureFormat format) {
  std::string file;
  const Surface surface = make_surface(picture, format, file);
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> cairo(cairo_create(surface.get()),
                                                                 cairo_destroy);
  if (format == PictureFormat::kPng) cairo_scale(cairo.get(), kPngScale, kPngScale);
  set_font(cairo.get(), all_text(picture));
  Drawing(cairo.get(), picture).draw();
  check(cairo_status(cairo.get()));
  if (format == PictureFormat::kPng) {
    check(cairo_surface_write_to_png_stream(surface.get(), append, &file));
  }
  cairo_surface_finish(surface.get());
  check(cairo_surface_status(surface.get()));
  return file;
}

}  // namespace
}  // namespace lk::emulator

// A name that C knows. NOLINTBEGIN(readability-identifier-naming)
extern "C" const lk::emulator::DrawModule lk_emu_draw_module;
const lk::emulator::DrawModule lk_emu_draw_module = {LKEMU_VERSION, lk::emulator::font_has,
                                                     lk::emulator::draw};
// NOLINTEND(readability-identifier-naming)
