/// @file fidelity_pictures DIRECTORY: writes the pictures of docs/internals/fidelity.md to
/// DIRECTORY.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/fidelity/chart.hpp"
#include "tests/fidelity/direct_drive.hpp"
#include "tests/fidelity/joint_figures.hpp"
#include "tests/model/profiles.hpp"

namespace lk::test {
namespace {

constexpr double kRpm = 60.0 / (2.0 * std::numbers::pi);
constexpr std::size_t kLevels = 16;

// --- torque and speed

/// Returns the speed in rpm against `torque_Nm` at the output, with a cold winding and factory
/// settings. Measured after two seconds of 0xA2 above the reachable speed.
Points torque_and_speed(const model::test::NamedDrive& drive, double most_Nm) {
  std::vector<model::DriveInit> inits(kLevels + 1, drive.init);
  for (std::size_t n = 0; n <= kLevels; ++n) {
    model::DriveInit& init = inits[n];
    init.params.load.tau = -most_Nm * static_cast<double>(n) / kLevels;
    init.params.thermal.C_winding = init.params.thermal.C_housing = 1e6;
    init.settings.protections = {};
  }
  model::DriveBank bank(inits);
  for (std::size_t n = 0; n <= kLevels; ++n) bank.command(n, model::Speed{1e4});
  bank.advance(model::test::ticks_in(drive.init.params, 2.0));
  std::vector<double> before_rad;
  for (std::size_t n = 0; n <= kLevels; ++n) before_rad.push_back(bank.truth(n).theta_out);
  bank.advance(model::test::ticks_in(drive.init.params, 0.1));
  Points points;
  for (std::size_t n = 0; n <= kLevels; ++n) {
    const double rpm = (bank.truth(n).theta_out - before_rad[n]) / 0.1 * kRpm;
    // A load that is too large turns it backwards.
    if (rpm > 0) points.emplace_back(-inits[n].params.load.tau, rpm);
  }
  return points;
}

Panel torque_panel(const model::test::NamedDrive& drive) {
  const emulator::Profile motor = profile(drive.name);
  const emulator::Rating& rating = motor.rating;
  const model::MotorParams& m = motor.drive.motor;
  const double i_max = std::min(drive.init.settings.i_q_max,
                                motor.drive.supply.v_source / std::numbers::sqrt3 / m.R_s);
  const double strongest_Nm = model::test::k_t(m) * i_max * motor.drive.mechanics.gear_ratio;
  const double most_Nm = 1.05 * std::max({strongest_Nm, rating.torque_rated_Nm});
  Panel panel{drive.name,
              "Nm",
              "rpm at " + std::to_string(std::lround(motor.drive.supply.v_source)) + " V",
              {}};
  panel.lines.push_back({torque_and_speed(drive, most_Nm), false, false});
  Points printed;
  if (rating.speed_no_load_rpm > 0) printed.emplace_back(0, rating.speed_no_load_rpm);
  if (rating.speed_rated_rpm > 0 && rating.torque_rated_Nm > 0) {
    printed.emplace_back(rating.torque_rated_Nm, rating.speed_rated_rpm);
  }
  panel.lines.push_back({printed, true, true});
  return panel;
}

std::string torque_picture() {
  std::vector<Panel> panels;
  for (const auto& drive : model::test::all_profiles()) panels.push_back(torque_panel(drive));
  return chart("Torque and speed of each motor, and what its vendor prints", panels, 4);
}

// --- the log of three joints

/// First samples of the log's start, iq in LSB, and of its stop, as speeds.
const std::vector<double> kRealStart_lsb{19, -5, -54, -36, -18, 2, 13, 5, 7, -20, -39, -20, -9};
const std::vector<double> kRealStop_dps{-576, -18};

/// Returns samples 12 ms apart, the first at `begin_ms`.
Points samples(const std::vector<double>& values, double begin_ms = 0) {
  Points points;
  for (std::size_t n = 0; n < values.size(); ++n) {
    points.emplace_back(begin_ms + 12.0 * static_cast<double>(n), values[n]);
  }
  return points;
}

Panel start_panel() {
  Panel panel{"start: iq", "ms", "LSB", {}};
  for (const JointLog& log : joint_moves()) {
    panel.lines.push_back(
        {samples(log.pick(0, kRealStart_lsb.size(), &JointSample::iq_lsb)), false, false});
  }
  // The first sample precedes the command.
  panel.lines.push_back({samples(kRealStart_lsb, -12), true, false});
  return panel;
}

Panel stop_panel() {
  Panel panel{"stop: speed", "ms", "dps", {}};
  for (const JointLog& log : joint_moves()) {
    const auto from = log.stop_begins - 1;
    panel.lines.push_back(
        {samples(log.pick(from, from + 16, &JointSample::speed_dps)), false, false});
  }
  panel.lines.push_back({samples(kRealStop_dps), true, true});
  return panel;
}

/// Draws the emulated band and the real figure.
Panel figure_panel(const JointFigure& figure) {
  const auto comma = figure.name.rfind(", ");
  const bool has_unit = figure.name.find(" of the speed, ") != std::string::npos ||
                        figure.name.find("LSB") != std::string::npos;
  Panel panel{has_unit ? figure.name.substr(0, comma) : figure.name,
              "",
              has_unit ? figure.name.substr(comma + 2) : "",
              {}};
  const Band band = emulated_band(figure);
  panel.lines.push_back({{{1, band.low}, {1, band.high}}, false, false});
  panel.lines.push_back({{{1, band.low}, {1, band.high}}, false, true});
  panel.lines.push_back({{{2, figure.real.low}, {2, figure.real.high}}, true, false});
  panel.lines.push_back({{{2, figure.real.low}, {2, figure.real.high}}, true, true});
  return panel;
}

std::string joint_picture() {
  std::vector<Panel> panels{start_panel(), stop_panel()};
  for (const JointFigure& figure : joint_figures()) panels.push_back(figure_panel(figure));
  return chart("A log of three joints: twelve emulated moves, and bands of 99 % of three of them",
               panels, 4);
}

// --- the log of a direct drive

Panel torque_step_panel() {
  std::vector<double> after_ms;
  for (int ms = 0; ms <= 32; ++ms) after_ms.push_back(ms);
  const std::vector<double> shares = torque_shares(after_ms);
  Panel panel{"0xA1: iq over command", "ms", "", {{}}};
  for (std::size_t n = 0; n < shares.size(); ++n) {
    panel.lines[0].points.emplace_back(after_ms[n], shares[n]);
  }
  for (const LoggedTorque& moment : kLoggedTorque) {
    const Points range{{moment.after_ms, moment.low}, {moment.after_ms, moment.high}};
    panel.lines.push_back({range, true, false});
  }
  return panel;
}

Panel direct_start_panel() {
  constexpr double kSampling_ms = 2.5;
  Panel panel{"0xA2, 573 dps: speed", "ms", "dps", {}};
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Host host = logged_specimen(seed);
    const auto before = host.state_2();
    Points points{{0, before.speed_dps}};
    host.get<protocol::State2>(protocol::Speed{.speed_dps = 573});
    for (std::size_t n = 1; n < kLoggedStart_dps.size(); ++n) {
      host.wait(std::chrono::microseconds(2500));
      points.emplace_back(kSampling_ms * static_cast<double>(n), host.state_2().speed_dps);
    }
    panel.lines.push_back({points, false, false});
  }
  Points logged;
  for (std::size_t n = 0; n < kLoggedStart_dps.size(); ++n) {
    logged.emplace_back(kSampling_ms * static_cast<double>(n), kLoggedStart_dps[n]);
  }
  panel.lines.push_back({logged, true, false});
  return panel;
}

std::string direct_drive_picture() {
  return chart("A log of a direct drive", {torque_step_panel(), direct_start_panel()}, 2);
}

bool write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) std::fprintf(stderr, "fidelity_pictures: cannot write %s\n", file.c_str());
  return stream.good();
}

}  // namespace
}  // namespace lk::test

int main(int argc, char** argv) {
  using namespace lk::test;
  if (argc != 2) {
    std::fputs("usage: fidelity_pictures DIRECTORY, which is docs/pictures\n", stderr);
    return 2;
  }
  const std::filesystem::path directory = argv[1];
  return write(directory / "torque-speed.svg", torque_picture()) &&
                 write(directory / "joints.svg", joint_picture()) &&
                 write(directory / "direct-drive.svg", direct_drive_picture())
             ? 0
             : 1;
}
