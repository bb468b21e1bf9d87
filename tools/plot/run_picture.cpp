#include "tools/plot/run_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "emulator/ground/start_error.hpp"
#include "tools/plot/axis.hpp"
#include "tools/plot/panel_table.hpp"
#include "tools/plot/trace.hpp"

namespace lk::emulator {
namespace {

constexpr Words kDrive = {"drive", "驱动器"};
constexpr Words kTime = {"time, s", "时间，s"};
constexpr Words kNotInFile = {"not in the file", "文件中没有"};
constexpr Words kNoRows = {"no rows", "没有数据行"};
constexpr Words kLeftOut = {"not shown", "未显示"};

bool has(const std::vector<RunColumn>& columns, std::string_view signal) {
  return std::ranges::find(columns, signal, &RunColumn::signal) != columns.end();
}

/// What of a panel the file can show.
std::vector<const PlotQuantity*> present(const PlotSubject& subject,
                                         const std::vector<RunColumn>& columns) {
  std::vector<const PlotQuantity*> found;
  for (const PlotQuantity& quantity : subject.quantities) {
    const bool other = !quantity.in_place_of.empty() && has(columns, quantity.in_place_of);
    if (has(columns, quantity.signal) && !other) found.push_back(&quantity);
  }
  return found;
}

constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);

std::size_t column_of(const std::vector<RunColumn>& columns, const PlottedDrive& drive,
                      std::string_view signal) {
  const auto found = std::ranges::find_if(columns, [&](const RunColumn& column) {
    return column.bus == drive.bus && column.id == drive.id && column.signal == signal;
  });
  return found == columns.end() ? kNowhere : static_cast<std::size_t>(found - columns.begin());
}

/// A line on its way from the rows to the picture.
struct Tracing {
  const PlotSubject* subject;
  const PlotQuantity* quantity;
  int colour;
  std::size_t column;
  std::size_t begins_with;  // column, or nowhere
  double shift = 0;
  bool begun = false;
  Trace trace = {};

  void add(double time_s, const std::vector<double>& row) {
    const double value = row[column];
    if (!begun && begins_with != kNowhere && std::isfinite(value - row[begins_with])) {
      shift = row[begins_with] - value;
      begun = true;
    }
    trace.add(time_s, value + shift);
  }
};

std::vector<Tracing> plan(const std::vector<RunColumn>& columns, const ChosenDrives& drives) {
  std::vector<Tracing> all;
  for (const PlotSubject& subject : plot_subjects()) {
    for (const PlotQuantity* quantity : present(subject, columns)) {
      for (std::size_t n = 0; n < drives.shown.size(); ++n) {
        const std::size_t column = column_of(columns, drives.shown[n], quantity->signal);
        if (column == kNowhere) continue;
        const std::size_t first = column_of(columns, drives.shown[n], quantity->begins_with);
        all.push_back({&subject, quantity, static_cast<int>(n), column, first});
      }
    }
  }
  return all;
}

std::string missing_text(const PlotSubject& subject, Language language) {
  std::string signals;
  for (const PlotQuantity& quantity : subject.quantities) {
    if (!quantity.in_place_of.empty()) continue;
    signals += (signals.empty() ? "" : ", ") + std::string(quantity.signal);
  }
  return fmt::format("{}: {} ({})", subject.name.in(language), kNotInFile.in(language), signals);
}

/// An axis for what was drawn on this side, if there is anything. What hardly changes is above the
/// middle on the right axis and below it on the left one, lest one line hides the other.
std::optional<PlotAxis> axis_of(const PlotPanel& panel, bool right, const Words& title,
                                double least_span, Language language) {
  const bool both = std::ranges::count(panel.lines, !right, &PlotLine::on_right_axis) > 0;
  const double below = right ? 0.75 : 0.25;
  PlotRange range;
  for (const PlotLine& line : panel.lines) {
    if (line.on_right_axis != right) continue;
    for (const auto& run : line.runs) {
      for (const PlotPoint& point : run) range.add(point.value);
    }
  }
  if (range.empty) return std::nullopt;
  return value_axis(std::string(title.in(language)), range, least_span, both ? below : 0.5, 7);
}

/// Where there is one drive only, the right axis has a colour of its own.
PlotPanel panel_of(const PlotSubject& subject, const std::vector<RunColumn>& columns,
                   const std::vector<Tracing>& tracings, bool one_drive, Language language) {
  PlotPanel panel;
  const std::vector<const PlotQuantity*> quantities = present(subject, columns);
  if (quantities.empty()) {
    panel.missing = missing_text(subject, language);
    return panel;
  }
  for (const PlotQuantity* quantity : quantities) {
    PlotKey key{std::string(quantity->label.in(language)), quantity->style, std::nullopt};
    if (one_drive) key.colour = quantity->on_right_axis ? 1 : 0;
    panel.keys.push_back(std::move(key));
  }
  for (const Tracing& tracing : tracings) {
    if (tracing.subject != &subject) continue;
    const bool right = tracing.quantity->on_right_axis;
    panel.lines.push_back({one_drive && right ? 1 : tracing.colour, tracing.quantity->style, right,
                           tracing.trace.runs()});
  }
  panel.left = axis_of(panel, false, subject.left_axis, subject.left_span, language);
  panel.right = axis_of(panel, true, subject.right_axis, subject.right_span, language);
  if (!panel.left && !panel.right) {
    panel.missing = fmt::format("{}: {}", subject.name.in(language), kNoRows.in(language));
  }
  return panel;
}

std::string left_out_text(const ChosenDrives& drives, Language language) {
  constexpr std::size_t kWidest = 100;  // and a name, in bytes: what fits across the picture
  std::string text;
  for (const PlottedDrive& drive : drives.left_out) {
    if (text.size() > kWidest) {
      text += ", …";
      break;
    }
    text += (text.empty() ? "" : ", ") + drive_name(drive, language);
  }
  return text.empty() ? "" : fmt::format("{}: {}", kLeftOut.in(language), text);
}

}  // namespace

ChosenDrives choose_drives(const std::vector<RunColumn>& columns, const DriveChoice& choice) {
  std::vector<PlottedDrive> drives;
  for (const RunColumn& column : columns) {
    if (column.id == 0) continue;
    const PlottedDrive drive{column.bus, column.id};
    const bool wanted = (choice.bus.empty() || column.bus == choice.bus) &&
                        (choice.ids.empty() || std::ranges::count(choice.ids, column.id) > 0);
    if (wanted && std::ranges::count(drives, drive) == 0) drives.push_back(drive);
  }
  if (!choice.bus.empty() && std::ranges::count(columns, choice.bus, &RunColumn::bus) == 0) {
    throw StartError("--bus: the file has no bus " + choice.bus);
  }
  for (const int id : choice.ids) {
    if (std::ranges::count(drives, id, &PlottedDrive::id) == 0) {
      throw StartError(fmt::format("--ids: the file has no drive {}", id));
    }
  }
  ChosenDrives chosen;
  for (const PlottedDrive& drive : drives) {
    const bool room = chosen.shown.size() < kPlotColours;
    (room ? chosen.shown : chosen.left_out).push_back(drive);
  }
  if (!choice.ids.empty() && !chosen.left_out.empty()) {
    throw StartError(fmt::format("--ids: {} drives cannot be told apart in one picture, {} can",
                                 drives.size(), kPlotColours));
  }
  return chosen;
}

std::string drive_name(const PlottedDrive& drive, Language language) {
  const std::string name = fmt::format("{} {}", kDrive.in(language), drive.id);
  return drive.bus.empty() ? name : drive.bus + " " + name;
}

Picture picture_of(RunCsv& csv, const ChosenDrives& drives, const std::string& title,
                   Language language, PlottedRows& rows) {
  std::vector<Tracing> tracings = plan(csv.columns(), drives);
  PlotRange times;
  std::vector<double> row;
  for (double time_s = 0; csv.next(time_s, row);) {
    times.add(time_s);
    for (Tracing& tracing : tracings) tracing.add(time_s, row);
    ++rows.count;
  }
  rows.first_s = times.low;
  rows.last_s = times.high;
  Picture picture;
  picture.language = language;
  picture.title = title;
  picture.subtitle = left_out_text(drives, language);
  for (const PlottedDrive& drive : drives.shown) {
    picture.drives.push_back(drive_name(drive, language));
  }
  picture.time = time_axis(std::string(kTime.in(language)), times, 10);
  for (const PlotSubject& subject : plot_subjects()) {
    picture.panels.push_back(
        panel_of(subject, csv.columns(), tracings, drives.shown.size() == 1, language));
  }
  return picture;
}

}  // namespace lk::emulator
