// What the pictures in reports of campaign and identify show, before they are drawn: rows, traces,
// axes, drives and panels.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "emulator/core/servo/signals.hpp"
#include "emulator/ground/start_error.hpp"
#include "tests/support/temp_directory.hpp"
#include "tools/plot/axis.hpp"
#include "tools/plot/panel_table.hpp"
#include "tools/plot/run_picture.hpp"
#include "tools/plot/svg.hpp"
#include "tools/plot/svg_text.hpp"
#include "tools/plot/trace.hpp"

namespace lk::emulator {
namespace plot_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A file for this test alone.
class CsvFile {
 public:
  explicit CsvFile(const std::string& text) : path_(own_.put("run.csv", text)) {}

  const std::filesystem::path& path() const { return path_; }

 private:
  const test::TempDirectory own_;
  const std::filesystem::path path_;
};

/// What is said of a file, without its name in front; "" when nothing is.
std::string complaint(const std::string& text) {
  const CsvFile file(text);
  try {
    RunCsv csv = open_run_csv(file.path());
    double time_s = 0;
    std::vector<double> row;
    while (csv.next(time_s, row)) {
    }
  } catch (const StartError& problem) {
    const std::string what = problem.what();
    const std::string front = "plot: " + file.path().string();
    EXPECT_EQ(what.substr(0, front.size()), front);
    EXPECT_EQ(what.find('\n'), std::string::npos);
    return what.substr(front.size());
  }
  return "";
}

Picture picture(const std::string& text, const DriveChoice& choice = {}) {
  const CsvFile file(text);
  RunCsv csv = open_run_csv(file.path());
  PlottedRows rows;
  return picture_of(csv, choose_drives(csv.columns(), choice), "title", Language::kEnglish, rows);
}

// --- rows

/// Signals of a body are of no drive, and none of the panels has them.
TEST(PlotCsv, LeavesOutTheBody) {
  const CsvFile file("time_s,1.speed_dps,body.trunk.z_m,body.fallen\n0,1.5,0.3,0\n");
  RunCsv csv = open_run_csv(file.path());
  ASSERT_EQ(csv.columns().size(), 3U);
  EXPECT_EQ(csv.columns()[1].id, 0);
  EXPECT_EQ(csv.columns()[1].signal, "body.trunk.z_m");
  EXPECT_EQ(choose_drives(csv.columns(), {}).shown.size(), 1U);
}

TEST(PlotCsv, ReadsWhatARunWrites) {
  const CsvFile file("time_s,vcan0.1.speed_dps,can0.5.32.iq_A\n0,1.5,-2e-3\n0.01,nan,\r\n");
  RunCsv csv = open_run_csv(file.path());
  ASSERT_EQ(csv.columns().size(), 2U);
  EXPECT_EQ(csv.columns()[0].bus, "vcan0");
  EXPECT_EQ(csv.columns()[0].id, 1);
  EXPECT_EQ(csv.columns()[0].signal, "speed_dps");
  EXPECT_EQ(csv.columns()[1].bus, "can0.5");
  EXPECT_EQ(csv.columns()[1].id, 32);
  double time_s = -1;
  std::vector<double> row;
  ASSERT_TRUE(csv.next(time_s, row));
  EXPECT_EQ(time_s, 0);
  EXPECT_EQ(row, (std::vector<double>{1.5, -0.002}));
  ASSERT_TRUE(csv.next(time_s, row));
  EXPECT_EQ(time_s, 0.01);
  EXPECT_TRUE(std::isnan(row[0]));
  EXPECT_TRUE(std::isnan(row[1]));
  EXPECT_FALSE(csv.next(time_s, row));
}

TEST(PlotCsv, TakesAHeaderAloneAndALastLineWithoutAnEnd) {
  EXPECT_EQ(complaint("time_s,1.iq_A\n"), "");
  EXPECT_EQ(complaint("time_s\n0\n"), "");
  EXPECT_EQ(complaint("time_s,1.iq_A\n0,1\n1,2"), "");
}

TEST(PlotCsv, SaysWhereAFileIsNoneOfOurs) {
  EXPECT_EQ(complaint(""), " is empty");
  EXPECT_EQ(complaint("\n0,1\n").substr(0, 22), ":1: is not a CSV file ");
  EXPECT_EQ(complaint("time_stamp,1.iq_A\n").substr(0, 22), ":1: is not a CSV file ");
  EXPECT_EQ(complaint(std::string(3U << 20U, 'x')).substr(0, 22), ":1: is not a CSV file ");
  EXPECT_EQ(complaint(std::string("\x7F"
                                  "ELF\0\x1b[2J\n",
                                  10))
                .substr(0, 22),
            ":1: is not a CSV file ");
  const std::string named = " is not called like 1.speed_dps or vcan0.1.speed_dps";
  for (const char* name :
       {"speed_dps", "1", "x.speed_dps", "33.speed_dps", "0.speed_dps", ".", "..", "1x.speed_dps",
        "sixteen_letters_.1.speed_dps", "-1.speed_dps", ""}) {
    EXPECT_EQ(complaint("time_s,1.iq_A," + std::string(name) + ",2.iq_A\n"), ":1: column 3" + named)
        << name;
  }
  EXPECT_EQ(complaint("time_s,1.iq_A,1.iq_A\n"), ":1: column 3 is there twice");
  std::string wide = "time_s";
  for (int n = 0; n < 20'000; ++n) wide += ",1.a" + std::to_string(n);
  EXPECT_EQ(complaint(wide + "\n"), ":1: more columns than lk-emu writes");
  EXPECT_EQ(complaint("time_s,1.iq_A\n0,1\n1\n"),
            ":3: 1 values, but the first line names 2 columns");
  EXPECT_EQ(complaint("time_s,1.iq_A\n0,1,2\n"),
            ":2: 3 values, but the first line names 2 columns");
  EXPECT_EQ(complaint("time_s,1.iq_A\n0,1\n0.1,1A\n"), ":3: column 2 is not a number");
  EXPECT_EQ(complaint("time_s,1.iq_A\n0, 1\n"), ":2: column 2 is not a number");
  EXPECT_EQ(complaint(std::string("time_s,1.iq_A\n0,1\0\n", 19)), ":2: column 2 is not a number");
  EXPECT_EQ(complaint("time_s,1.iq_A\nnan,1\n"), ":2: has no time");
  EXPECT_EQ(complaint("time_s,1.iq_A\n,1\n"), ":2: has no time");
  EXPECT_EQ(complaint("time_s,1.iq_A\n1,1\n0.5,1\n"), ":3: is earlier than the line before it");
  EXPECT_EQ(complaint("time_s,1.iq_A\n1," + std::string(3U << 20U, '1') + "\n"),
            ":2: is longer than any line of lk-emu");
}

// --- traces

TEST(PlotTrace, KeepsAShortRunAsItIs) {
  Trace trace;
  for (int n = 0; n < 900; ++n) trace.add(n * 0.01, std::sin(n));
  const auto runs = trace.runs();
  ASSERT_EQ(runs.size(), 1U);
  ASSERT_EQ(runs[0].size(), 900U);
  for (int n = 0; n < 900; ++n) {
    EXPECT_EQ(runs[0][static_cast<std::size_t>(n)].time_s, n * 0.01);
    EXPECT_EQ(runs[0][static_cast<std::size_t>(n)].value, std::sin(n));
  }
}

TEST(PlotTrace, KeepsEverySpikeOfALongRunAndStaysSmall) {
  constexpr int kRows = 1'000'000;
  Trace trace;
  for (int n = 0; n < kRows; ++n) {
    const double spike = n == 123'457 ? 50 : n == 777'777 ? -60 : 0;
    trace.add(n * 1e-3, std::sin(n * 1e-4) + spike);
  }
  const auto runs = trace.runs();
  ASSERT_EQ(runs.size(), 1U);
  EXPECT_LE(runs[0].size(), 2U * 2048);
  EXPECT_GE(runs[0].size(), 2U * 1024 - 2);
  double before_s = -1;
  double highest = 0;
  double lowest = 0;
  double high_at_s = 0;
  double low_at_s = 0;
  for (const PlotPoint& point : runs[0]) {
    EXPECT_GT(point.time_s, before_s);
    before_s = point.time_s;
    if (point.value > highest) highest = point.value, high_at_s = point.time_s;
    if (point.value < lowest) lowest = point.value, low_at_s = point.time_s;
  }
  EXPECT_EQ(highest, std::sin(123'457 * 1e-4) + 50);
  EXPECT_EQ(high_at_s, 123'457 * 1e-3);
  EXPECT_EQ(lowest, std::sin(777'777 * 1e-4) - 60);
  EXPECT_EQ(low_at_s, 777'777 * 1e-3);
}

TEST(PlotTrace, BreaksWhereThereIsNoNumber) {
  Trace trace;
  double time_s = 0;
  for (const double value : {kNan, 1.0, 2.0, kNan, kNan, 3.0, kNan, 4.0, 5.0}) {
    trace.add(time_s, value);
    time_s += 1;
  }
  const auto runs = trace.runs();
  ASSERT_EQ(runs.size(), 3U);
  ASSERT_EQ(runs[0].size(), 2U);
  EXPECT_EQ(runs[0][0].time_s, 1);
  ASSERT_EQ(runs[1].size(), 1U);
  EXPECT_EQ(runs[1][0].value, 3);
  ASSERT_EQ(runs[2].size(), 2U);
  EXPECT_EQ(runs[2][1].time_s, 8);
}

TEST(PlotTrace, KeepsBothValuesOfOneTime) {
  Trace trace;
  trace.add(0, 1);
  trace.add(1, 5);
  trace.add(1, -5);
  const auto runs = trace.runs();
  ASSERT_EQ(runs.size(), 1U);
  ASSERT_EQ(runs[0].size(), 3U);
  EXPECT_EQ(runs[0][1].value, -5);
  EXPECT_EQ(runs[0][2].value, 5);
}

TEST(PlotTrace, HoldsNothingOfNothing) {
  Trace nothing;
  EXPECT_TRUE(nothing.runs().empty());
  nothing.add(0, kNan);
  nothing.add(1e300, kNan);
  EXPECT_TRUE(nothing.runs().empty());
}

// --- axes

std::vector<std::string> labels(const PlotAxis& axis) {
  std::vector<std::string> all;
  for (const PlotTick& tick : axis.ticks) all.push_back(tick.label);
  return all;
}

PlotAxis axis(double low, double high, double least_span = 0.1) {
  PlotRange range;
  range.add(high);
  range.add(low);
  return value_axis("", range, least_span, 0.5, 7);
}

TEST(PlotAxis, HasRoundTicks) {
  PlotRange range;
  range.add(0);
  range.add(5);
  const PlotAxis time = time_axis("t", range, 10);
  EXPECT_EQ(time.low, 0);
  EXPECT_EQ(time.high, 5);
  EXPECT_EQ(labels(time), (std::vector<std::string>{"0.0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0",
                                                    "3.5", "4.0", "4.5", "5.0"}));
  // -100..100 and 6 % on either side: 224 / 7 = 32, the next of 1, 2, 5 times ten to the n is 50.
  EXPECT_EQ(labels(axis(-100, 100)),
            (std::vector<std::string>{"\u2212100", "\u221250", "0", "50", "100"}));
}

TEST(PlotAxis, HasTicksThatAreRoundToTheLastBit) {
  for (int exponent = -8; exponent <= 290; ++exponent) {
    for (const char* factor : {"1", "2", "5"}) {
      const auto decimal = [&](int power) {
        return std::stod(factor + std::string("e") + std::to_string(power));
      };
      PlotRange range;
      range.add(0);
      range.add(decimal(exponent));
      const PlotAxis time = time_axis("t", range, 10);
      ASSERT_EQ(time.ticks.size(), 11U) << exponent;
      EXPECT_EQ(time.ticks[1].value, decimal(exponent - 1));
    }
  }
}

TEST(PlotAxis, ShowsAllThereIsAndNotOnlyNoise) {
  const PlotAxis wide = axis(-3, 7);
  EXPECT_LT(wide.low, -3);
  EXPECT_GT(wide.high, 7);
  PlotRange range;
  range.add(24);
  range.add(24.01);
  const PlotAxis low = value_axis("", range, 2, 0.25, 7);
  EXPECT_NEAR(low.high - low.low, 2 * 1.12, 1e-12);
  EXPECT_NEAR((24.005 - low.low) / (low.high - low.low), 0.5 - 0.25 / 1.12, 0.01);
}

TEST(PlotAxis, OfAnInstantHasTheInstantInItsMiddle) {
  for (const double time_s : {0.0, 3.0, 1e15, 1e300}) {
    PlotRange range;
    range.add(time_s);
    range.add(std::nextafter(time_s, 2e300));
    const PlotAxis time = time_axis("t", range, 10);
    EXPECT_LT(time.low, time_s);
    EXPECT_GT(time.high, range.high);
    EXPECT_GE(time.ticks.size(), 2U);
    EXPECT_LE(time.ticks.size(), 21U);
  }
}

TEST(PlotAxis, CopesWithNumbersOfAnySize) {
  for (const double value : {0.0, 1e-300, 1e-9, 1.0, 123456789.0, 1e18, 1e300}) {
    for (const PlotAxis& made : {axis(value, value), axis(-value, value), axis(-value, -value)}) {
      EXPECT_LT(made.low, made.high) << value;
      EXPECT_GE(made.ticks.size(), 2U) << value;
      EXPECT_LE(made.ticks.size(), 12U) << value;
      for (std::size_t n = 1; n < made.ticks.size(); ++n) {
        EXPECT_NE(made.ticks[n].label, made.ticks[n - 1].label);
      }
    }
  }
}

// --- drives

std::vector<RunColumn> columns_of(int drives, const std::string& bus = "") {
  std::vector<RunColumn> columns;
  for (int id = 1; id <= drives; ++id) {
    columns.push_back({bus, id, "speed_dps"});
    columns.push_back({bus, id, "iq_A"});
  }
  return columns;
}

TEST(PlotDrives, AreAsManyAsThereAreColours) {
  const ChosenDrives all = choose_drives(columns_of(8), {});
  EXPECT_EQ(all.shown.size(), 6U);
  EXPECT_EQ(all.left_out, (std::vector<PlottedDrive>{{"", 7}, {"", 8}}));
  const ChosenDrives some = choose_drives(columns_of(8), {"", {3, 8}});
  EXPECT_EQ(some.shown, (std::vector<PlottedDrive>{{"", 3}, {"", 8}}));
  EXPECT_TRUE(some.left_out.empty());
  EXPECT_THROW(choose_drives(columns_of(8), {"", {1, 2, 3, 4, 5, 6, 7}}), StartError);
  EXPECT_THROW(choose_drives(columns_of(8), {"", {9}}), StartError);
}

TEST(PlotDrives, AreOfTheBusThatIsNamed) {
  std::vector<RunColumn> columns = columns_of(2, "vcan0");
  for (const RunColumn& column : columns_of(1, "vcan1")) columns.push_back(column);
  EXPECT_EQ(choose_drives(columns, {}).shown.size(), 3U);
  EXPECT_EQ(choose_drives(columns, {"vcan1", {}}).shown, (std::vector<PlottedDrive>{{"vcan1", 1}}));
  EXPECT_THROW(choose_drives(columns, {"vcan1", {2}}), StartError);
  EXPECT_THROW(choose_drives(columns, {"vcan2", {}}), StartError);
}

// --- panels

TEST(PlotPanels, AreOfSignalsThatThereAre) {
  for (const PlotSubject& subject : plot_subjects()) {
    for (const PlotQuantity& quantity : subject.quantities) {
      EXPECT_NE(find_signal(quantity.signal), nullptr) << quantity.signal;
      for (const std::string_view other : {quantity.in_place_of, quantity.begins_with}) {
        EXPECT_TRUE(other.empty() || find_signal(other) != nullptr) << other;
      }
    }
  }
}

TEST(PlotPanels, ShowReferenceMeasuredAndTrue) {
  const Picture drawn =
      picture("time_s,1.angle_deg,1.true_rotor_deg,1.angle_ref_deg\n0,10,32,10\n1,20,43,21\n");
  ASSERT_EQ(drawn.panels.size(), 4U);
  const PlotPanel& position = drawn.panels[0];
  ASSERT_EQ(position.lines.size(), 3U);
  EXPECT_EQ(position.lines[0].style, LineStyle::kBroad);
  // The rotor's zero is arbitrary: 32 is where 10 was measured, so 43 is 21.
  EXPECT_EQ(position.lines[0].runs[0][0].value, 10);
  EXPECT_EQ(position.lines[0].runs[0][1].value, 21);
  EXPECT_EQ(position.lines[1].style, LineStyle::kSolid);
  EXPECT_EQ(position.lines[1].runs[0][1].value, 20);
  EXPECT_EQ(position.lines[2].style, LineStyle::kDashed);
  EXPECT_EQ(position.keys[2].label, "reference");
  EXPECT_EQ(position.left->title, "position, °");
}

TEST(PlotPanels, HaveTwoAxesForTemperatureAndVoltage) {
  const Picture drawn = picture("time_s,1.temperature_C,1.voltage_V\n0,25,24\n1,45,23\n");
  const PlotPanel& panel = drawn.panels[3];
  ASSERT_TRUE(panel.left && panel.right);
  EXPECT_FALSE(panel.lines[0].on_right_axis);
  EXPECT_TRUE(panel.lines[1].on_right_axis);
  EXPECT_NE(panel.lines[0].colour, panel.lines[1].colour);
  EXPECT_LT(panel.left->low, 25);
  EXPECT_GT(panel.left->high, 45);
  EXPECT_LT(panel.right->high, 26);
}

TEST(PlotPanels, SayWhatIsMissing) {
  const Picture drawn = picture("time_s,1.iq_A,1.some_future_signal\n0,1,2\n");
  EXPECT_EQ(drawn.panels[0].missing,
            "Position: not in the file (true_rotor_deg, angle_deg, angle_ref_deg)");
  EXPECT_TRUE(drawn.panels[2].missing.empty());
  EXPECT_EQ(picture("time_s,1.iq_A\n").panels[2].missing, "Current: no rows");
  EXPECT_EQ(picture("time_s,1.iq_A\n0,nan\n").panels[2].missing, "Current: no rows");
}

TEST(PlotPanels, HaveWordsInChinese) {
  const CsvFile file("time_s,1.iq_A\n0,1\n");
  RunCsv csv = open_run_csv(file.path());
  PlottedRows rows;
  const Picture drawn =
      picture_of(csv, choose_drives(csv.columns(), {}), "", Language::kChinese, rows);
  EXPECT_EQ(drawn.drives[0], "驱动器 1");
  EXPECT_EQ(drawn.panels[2].left->title, "电流，A");
  EXPECT_EQ(drawn.language, Language::kChinese);
}

TEST(PlotPanels, SayWhichDrivesAreLeftOut) {
  std::string seven = "time_s";
  std::string many = "time_s";
  for (int id = 1; id <= 32; ++id) {
    if (id <= 7) seven += "," + std::to_string(id) + ".iq_A";
    many += ",vcan0." + std::to_string(id) + ".iq_A";
  }
  EXPECT_EQ(picture("time_s,1.iq_A\n").subtitle, "");
  EXPECT_EQ(picture(seven + "\n").subtitle, "not shown: drive 7");
  const std::string text = picture(many + "\n").subtitle;
  EXPECT_TRUE(text.starts_with("not shown: vcan0 drive 7, vcan0 drive 8, ")) << text;
  EXPECT_TRUE(text.ends_with(", …")) << text;
  EXPECT_LT(text.size(), 150U);
}

// --- words

TEST(PlotWords, AreMadeToFit) {
  // 0.66 em each, 0.42 em for those that are narrow, 1 em for those that are wide.
  EXPECT_DOUBLE_EQ(assumed_width_px("ab µ°", 10), 4 * 6.6 + 4.2);
  EXPECT_DOUBLE_EQ(assumed_width_px("电压，V", 10), 3 * 10 + 6.6);
  EXPECT_DOUBLE_EQ(assumed_width_px("\u2212mi", 10), 10 + 10 + 4.2);
  const FittedText as_it_is = fit_text("abcd", 10, 26.5);
  EXPECT_EQ(as_it_is.text, "abcd");
  EXPECT_EQ(as_it_is.size_px, 10);
  EXPECT_EQ(fit_text("abcd", 10, 23.76).text, "abcd");
  EXPECT_DOUBLE_EQ(fit_text("abcd", 10, 23.76).size_px, 9);
  // At 8 px, 5.28 px each and 8 px for the ellipsis: 2 of them fit into 20 px.
  EXPECT_EQ(fit_text("abcd", 10, 20).text, "ab…");
  EXPECT_EQ(fit_text("abcd", 10, 20).size_px, 8);
  EXPECT_EQ(fit_text("电电电", 10, 20).text, "电…");
}

TEST(PlotSvg, HasADescriptionOfWhatIsMissingToo) {
  const std::string svg = to_svg(picture("time_s,1.iq_A,2.iq_A\n0,1,1\n"));
  EXPECT_NE(svg.find(" role=\"img\" xml:lang=\"en\""), std::string::npos);
  EXPECT_NE(svg.find("<title>title</title>\n<desc>drive 1, drive 2; Position: not in the file "
                     "(true_rotor_deg, angle_deg, angle_ref_deg); Speed: not in the file "
                     "(true_rotor_dps, speed_dps, speed_ref_dps); current, A; Temperature and "
                     "voltage: not in the file (winding_C, temperature_C, driver_temperature_C, "
                     "voltage_V)</desc>"),
            std::string::npos)
      << svg;
}

TEST(PlotSvg, HasNoPanelOfAnEmptyFile) {
  // Nothing to show: a head and what is missing, without times.
  const std::string svg = to_svg(picture("time_s,1.iq_A\n"));
  EXPECT_EQ(svg.find("class=\"panel\""), std::string::npos);
  EXPECT_EQ(svg.find("class=\"times\""), std::string::npos);
  EXPECT_NE(svg.find(">Current: no rows</text>"), std::string::npos);
  EXPECT_TRUE(svg.ends_with("</svg>\n"));
}

}  // namespace plot_test
}  // namespace lk::emulator
