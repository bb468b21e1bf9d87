// A CSV file of a run, whatever is in it: refused in one line, or a picture that can be drawn.

#include <cmath>
#include <memory>
#include <sstream>
#include <string>

#include "emulator/ground/start_error.hpp"
#include "tests/fuzz/support.hpp"
#include "tools/plot/run_picture.hpp"
#include "tools/plot/svg.hpp"

namespace lk::emulator {
namespace {

using fuzz::require;

void check_axis(const PlotAxis& axis) {
  require(std::isfinite(axis.low) && std::isfinite(axis.high) && axis.low < axis.high);
  require(axis.ticks.size() >= 2 && axis.ticks.size() < 25);
  for (const PlotTick& tick : axis.ticks) {
    const double margin = 1e-6 * (axis.high - axis.low);
    require(tick.value >= axis.low - margin && tick.value <= axis.high + margin);
  }
}

/// Every line lies between the ends of its axes, and time does not go back in it.
void check_line(const PlotLine& line, const PlotAxis& time, const PlotAxis& values) {
  for (const auto& run : line.runs) {
    require(!run.empty());
    double last_s = time.low;
    for (const PlotPoint& point : run) {
      require(point.time_s >= last_s && point.time_s <= time.high);
      require(point.value >= values.low && point.value <= values.high);
      last_s = point.time_s;
    }
  }
}

void check_picture(const Picture& picture) {
  check_axis(picture.time);
  require(picture.drives.size() <= kPlotColours);
  for (const PlotPanel& panel : picture.panels) {
    if (!panel.missing.empty()) continue;
    require(panel.left || panel.right);
    if (panel.left) check_axis(*panel.left);
    if (panel.right) check_axis(*panel.right);
    for (const PlotLine& line : panel.lines) {
      require(line.colour >= 0 && line.colour < kPlotColours);
      const auto& axis = line.on_right_axis ? panel.right : panel.left;
      if (axis) check_line(line, picture.time, *axis);
      require(axis || line.runs.empty());
    }
  }
}

/// Whatever a name is, there are the writer's own tags and no bytes that XML forbids.
void check_svg(const std::string& svg) {
  std::size_t opened = 0;
  for (const char c : svg) {
    require(static_cast<unsigned char>(c) >= 0x20 || c == '\n');
    if (c == '<') ++opened;
    if (c == '>') --opened;
    require(opened <= 1);
  }
  require(opened == 0 && svg.ends_with("</svg>\n"));
}

}  // namespace

void check(const std::string& text) {
  try {
    RunCsv csv(std::make_unique<std::istringstream>(text), "run.csv");
    PlottedRows rows;
    const Picture picture =
        picture_of(csv, choose_drives(csv.columns(), {}), "run", Language::kEnglish, rows);
    check_picture(picture);
    check_svg(to_svg(picture));
  } catch (const StartError& problem) {
    const std::string what = problem.what();
    require(what.starts_with("plot: run.csv") && what.find('\n') == std::string::npos);
  }
}

}  // namespace lk::emulator

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lk::emulator::check(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
