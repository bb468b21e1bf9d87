#include "tools/identify/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "emulator/ground/text.hpp"
#include "tools/plot/axis.hpp"
#include "tools/plot/svg.hpp"
#include "tools/plot/trace.hpp"

namespace lk::emulator {
namespace {

constexpr double kDegPerRad = 180 / std::numbers::pi;
/// Of the log, in the pictures of the balance.
constexpr double kShown_s = 6;

bool is_shown(const IdentifiedValue& one) {
  return one.estimate && quality_of(*one.estimate) != Quality::kUnknown;
}
char letter_of(const IdentifiedValue& one) {
  return one.estimate ? letter(quality_of(*one.estimate)) : letter(Quality::kUnknown);
}
std::string base_text(const IdentifiedValue& one) {
  return one.base > 0 ? fmt::format("{:.4g}", one.base) : "-";
}

/// What people have to know of how sure this is.
std::vector<std::string> beliefs(const IdentifiedDrive& drive) {
  std::vector<std::string> lines;
  if (!drive.track.servo.profile.drive.control.has_current_loop) {
    lines.emplace_back("An MS drive reports no current: of its mechanics its log tells nothing.");
    return lines;
  }
  if (!drive.balance) {
    lines.emplace_back(
        "The shaft hardly turned: a log of it at work, or that of a plan, would tell more.");
    return lines;
  }
  const BalanceCheck& check = drive.balance->check;
  if (!drive.voltage || !drive.voltage->k_t_Nm_A) {
    lines.emplace_back(
        "Torques show in amperes, over k_t: J and k_t only as a ratio, and every current "
        "would be the same with twice of all. A known weight or inertia on the shaft tells them "
        "apart, or a run at the limit of the voltage.");
  }
  lines.push_back(fmt::format(
      "{} windows of {:.0f} ms, {} with a commanded torque; {:.3g} A rms left. On the half that "
      "was held out {:.2f} times what is left on the half that was fitted{}.",
      check.windows, 2e3 * std::max(kHalfWindow_s, drive.track.median_step_s), check.commanded,
      check.rms_A, check.held_out_ratio,
      check.held_out_ratio <= 1.2 ? "" : ": the log is too short, or changed on the way"));
  const double white = 1.96 / std::sqrt(static_cast<double>(check.windows) / 2);
  lines.push_back(fmt::format(
      "What is left goes on from window to window with {:.2f} (white noise: within ±{:.2f} in 95 "
      "of "
      "100 logs){}.",
      check.autocorrelation, white,
      std::abs(check.autocorrelation) <= 0.2 ? ""
                                             : ": something acts on the shaft that the model does "
                                               "not have, a load that moves or a cable"));
  if (check.commanded < kFewestCommanded) {
    lines.emplace_back(
        "Hardly any torque was commanded: iq between the samples is a guess, and the inertia with "
        "it. lk-emu identify --plan writes a script that does better.");
  }
  lines.push_back(fmt::format("A command acts {:.2f} ms after its stamp, seen from the samples.",
                              drive.balance->delay_s * 1e3));
  std::string ripples;
  for (const Cogging& one : drive.balance->cogging) {
    const bool offsets = &one == drive.offset_ripple();
    ripples +=
        fmt::format("{}{} times a turn ({:.2g} A{})", ripples.empty() ? "" : ", ", one.order,
                    one.amplitude_A.value,
                    offsets ? "; the pole pairs: perhaps offsets of the current sensors" : "");
  }
  if (!ripples.empty()) lines.push_back("It cogs " + ripples + ".");
  return lines;
}

PlotLine line(int colour, LineStyle style, const Trace& trace) {
  PlotLine made;
  made.colour = colour;
  made.style = style;
  made.runs = trace.runs();
  return made;
}

PlotPanel panel(const char* title, double least_span, std::vector<PlotLine> lines,
                std::vector<PlotKey> keys) {
  PlotPanel made;
  PlotRange range;
  for (const PlotLine& one : lines) {
    for (const auto& run : one.runs) {
      for (const PlotPoint& point : run) range.add(point.value);
    }
  }
  made.lines = std::move(lines);
  made.keys = std::move(keys);
  if (range.empty) {
    made.missing = title;
  } else {
    made.left = value_axis(title, range, least_span, 0.5, 7);
  }
  return made;
}

Picture picture(const std::string& title, std::vector<PlotPanel> panels) {
  Picture made;
  made.title = title;
  PlotRange times;
  for (const PlotPanel& one : panels) {
    for (const PlotLine& l : one.lines) {
      for (const auto& run : l.runs) {
        for (const PlotPoint& point : run) times.add(point.time_s);
      }
    }
  }
  made.time = time_axis("time, s", times, 10);
  made.panels = std::move(panels);
  return made;
}

/// The part of the log that is busiest: where the currents differ most.
double shown_from_s(const BalanceFit& fit) {
  double best_s = fit.windows.front().time_s;
  double most = -1;
  for (std::size_t n = 0; n < fit.windows.size(); n += 50) {
    double squares = 0;
    for (std::size_t k = n; k < fit.windows.size(); ++k) {
      if (fit.windows[k].time_s > fit.windows[n].time_s + kShown_s) break;
      squares += std::pow(fit.windows[k].iq_A, 2);
    }
    if (squares <= most) continue;
    most = squares;
    best_s = fit.windows[n].time_s;
  }
  return best_s;
}

std::string balance_picture(const IdentifiedDrive& drive) {
  const BalanceFit& fit = *drive.balance;
  const double from_s = shown_from_s(fit);
  // With the numbers of the motor file: what the emulator would have expected before.
  Eigen::VectorXd base = Eigen::VectorXd::Zero(fit.coefficients.size());
  const auto of_base = [&](BalanceTerm term, std::string_view key) {
    base(static_cast<Eigen::Index>(term)) = find_identified(key)->base(drive.track.servo);
  };
  of_base(BalanceTerm::kInertia, "inertia_A_s2_rad");
  of_base(BalanceTerm::kCoulomb, "coulomb_A");
  of_base(BalanceTerm::kViscous, "viscous_A_s_rad");
  Trace given, expected, before, left, speed;
  for (const BalanceWindow& window : fit.windows) {
    if (window.time_s < from_s || window.time_s > from_s + kShown_s) continue;
    given.add(window.time_s, window.iq_A);
    expected.add(window.time_s, fit.expected_A(window));
    before.add(window.time_s, window.terms.dot(base));
    left.add(window.time_s, window.iq_A - fit.expected_A(window));
    speed.add(window.time_s, window.speed_rad_s * kDegPerRad);
  }
  return to_svg(
      picture(fmt::format("Drive {}: what the drive gave, and what the balance of torques expects",
                          drive.track.id),
              {panel("iq, A", 0.1,
                     {line(3, LineStyle::kDotted, before), line(0, LineStyle::kBroad, given),
                      line(1, LineStyle::kSolid, expected)},
                     {{"log", LineStyle::kBroad, 0},
                      {"expected", LineStyle::kSolid, 1},
                      {"the same of the motor file, without cogging", LineStyle::kDotted, 3}}),
               panel("left, A", 0.02, {line(2, LineStyle::kSolid, left)}, {}),
               panel("speed, dps", 10, {line(0, LineStyle::kSolid, speed)}, {})}));
}

std::string moves_picture(const IdentifiedDrive& drive) {
  const PositionLoopFit& fit = *drive.position_loop;
  Trace logged, emulated, left;
  for (std::size_t n = 0; n < fit.time_s.size(); ++n) {
    logged.add(fit.time_s[n], fit.logged_rad[n] * kDegPerRad);
    emulated.add(fit.time_s[n], fit.emulated_rad[n] * kDegPerRad);
    left.add(fit.time_s[n], (fit.logged_rad[n] - fit.emulated_rad[n]) * kDegPerRad);
  }
  return to_svg(
      picture(fmt::format("Drive {}: moves of the log, and emulated", drive.track.id),
              {panel("angle, degrees", 1,
                     {line(0, LineStyle::kBroad, logged), line(1, LineStyle::kSolid, emulated)},
                     {{"log", LineStyle::kBroad, 0}, {"emulated", LineStyle::kSolid, 1}}),
               panel("left, degrees", 0.1, {line(2, LineStyle::kSolid, left)}, {})}));
}

std::string drive_html(const IdentifiedDrive& drive) {
  std::string html = fmt::format(
      "<h2>Drive {} on {}</h2>\n<p>{}, {} replies, {} of {} queries unanswered.</p>\n",
      drive.track.id, xml_escaped(drive.track.interface), xml_escaped(drive.track.guess.options()),
      drive.track.samples.size(), drive.track.unanswered, drive.track.queries);
  html += "<table><tr><th></th><th>value</th><th>95 % interval</th><th>quality</th><th>" +
          xml_escaped(drive.track.servo.profile.name) + "</th><th>from</th></tr>\n";
  for (const IdentifiedValue& one : drive.values) {
    const bool shown = is_shown(one);
    html += fmt::format(
        "<tr><td>{}{}</td><td>{}</td><td>{}</td><td "
        "class=\"q{}\">{}</td><td>{}</td><td>{}</td></tr>\n",
        xml_escaped(one.quantity->label),
        one.quantity->unit.empty() ? "" : ", " + xml_escaped(one.quantity->unit),
        shown ? fmt::format("{:.4g}", one.estimate->value) : "not told",
        shown ? fmt::format("{:.4g} to {:.4g}", one.estimate->low(), one.estimate->high()) : "",
        letter_of(one), letter_of(one), base_text(one),
        shown ? xml_escaped(one.quantity->how)
              : "would tell: " + xml_escaped(one.quantity->experiment));
  }
  html += "</table>\n<ul>\n";
  for (const std::string& belief : beliefs(drive)) html += "<li>" + xml_escaped(belief) + "</li>\n";
  html += "</ul>\n";
  if (drive.balance) html += balance_picture(drive);
  if (drive.position_loop) html += moves_picture(drive);
  return html;
}

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>What the log tells of the motors</title>
<style>
body { font: 16px/1.5 system-ui, sans-serif; max-width: 1100px; margin: 2em auto; padding: 0 1em; color: #222; background: #fff }
table { border-collapse: collapse; width: 100% }
th, td { text-align: left; padding: .2em .6em; border-bottom: 1px solid #ddd; vertical-align: top }
.qA { background: #d5efdc } .qB { background: #eef3cf } .qC { background: #fbe6c9 } .qU { color: #666 }
svg { max-width: 100%; height: auto; margin: 1em 0 }
</style></head><body>
<h1>What the log tells of the motors</h1>
)";

}  // namespace

std::string identified_table_text(const IdentifiedDrive& drive) {
  std::string text =
      fmt::format("drive {} on {}: {}, {} replies, every {:.1f} ms\n", drive.track.id,
                  on_one_line(drive.track.interface), drive.track.guess.options(),
                  drive.track.samples.size(), drive.track.median_step_s * 1e3);
  for (const IdentifiedValue& one : drive.values) {
    const bool shown = is_shown(one);
    text +=
        fmt::format("  {}  {:<46} {:<34} {:<8} {}\n", letter_of(one), one.quantity->label,
                    shown ? fmt::format("{:.4g}  {:.4g} .. {:.4g}", one.estimate->value,
                                        one.estimate->low(), one.estimate->high())
                          : "not told",
                    shown ? one.quantity->unit : "",
                    shown ? fmt::format("({} {})", drive.track.servo.profile.name, base_text(one))
                          : fmt::format("would: {}", one.quantity->experiment));
  }
  for (const std::string& belief : beliefs(drive)) text += "  " + belief + "\n";
  return text;
}

std::string identified_report(const std::vector<IdentifiedDrive>& drives,
                              const std::vector<std::string>& logs) {
  std::string html = kHead;
  std::string names;
  for (const std::string& log : logs) names += (names.empty() ? "" : ", ") + xml_escaped(log);
  html +=
      "<p>" + names + ". Quality: A within 5 %, B within 15 %, C within 50 %, U: not told.</p>\n";
  for (const IdentifiedDrive& drive : drives) html += drive_html(drive);
  return html + "</body></html>\n";
}

}  // namespace lk::emulator
