#include "tests/fidelity/texture_table.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/fidelity/drives.hpp"
#include "tests/fidelity/statistics.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::test {
namespace {

constexpr int kSpecimens = 20;
constexpr std::size_t kSamples = 800;
constexpr emulator::SimTime kTextureSampling = std::chrono::microseconds(2500);
constexpr double kLeastShare = 0.05;  // of the variance, of an order that the table names

/// Replies of one specimen.
struct Samples {
  std::vector<double> turns, speed_dps, iq_A;
};

std::vector<Samples> run_specimens(const emulator::ServoConfig& drive) {
  emulator::BusConfig config = bus_config({});
  for (int id = 1; id <= kSpecimens; ++id) {
    config.servos.push_back(drive);
    config.servos.back().id = id;
  }
  Host host(config);
  host.wait(200ms);
  for (int id = 1; id <= kSpecimens; ++id) {
    host.get<protocol::State2>(protocol::Speed{.speed_dps = 573}, id);
  }
  host.wait(1s);
  std::vector<Samples> specimens(kSpecimens);
  for (std::size_t n = 0; n < kSamples; ++n) {
    host.wait(kTextureSampling);
    for (int id = 1; id <= kSpecimens; ++id) {
      Samples& one = specimens[static_cast<std::size_t>(id - 1)];
      const auto state = host.state_2(id);
      one.turns.push_back(host.bus.truth(id).theta_m / (2 * std::numbers::pi));
      one.speed_dps.push_back(state.speed_dps);
      one.iq_A.push_back(state.iq_A);
    }
  }
  return specimens;
}

template <class Of>
double median(const std::vector<Samples>& specimens, Of of) {
  std::vector<double> values;
  for (const Samples& one : specimens) values.push_back(of(one));
  return quantile(values, 0.5);
}

std::string number(const char* format, double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

/// Returns the largest orders of the speed with their shares, e.g. "36 (0.80), 42 (0.10)".
std::string orders(const std::vector<Samples>& specimens, const model::DriveParams& drive) {
  const int slots = drive.mechanics.cogging_per_turn;
  const int pairs = drive.motor.pole_pairs;
  std::vector<std::pair<double, int>> found;
  for (const int order : {1, 2, pairs, 2 * pairs, slots, 3 * slots, 6 * pairs}) {
    const double share = median(specimens, [order](const Samples& one) {
      return spectral_share(one.turns, one.speed_dps, order);
    });
    if (share >= kLeastShare) found.emplace_back(share, order);
  }
  std::sort(found.rbegin(), found.rend());
  std::string text;
  for (const auto& [share, order] : found) {
    text += (text.empty() ? "" : ", ") + std::to_string(order) + number(" (%.2f)", share);
  }
  return text.empty() ? "–" : text;
}

std::string row(const std::string& motor, const std::string& generation) {
  const emulator::ServoConfig drive = delivered(motor, generation);
  const std::vector<Samples> specimens = run_specimens(drive);
  const auto speed = [](const Samples& one) { return deviation(one.speed_dps); };
  const auto lag_1 = [](const Samples& one) { return autocorrelation(one.speed_dps); };
  const auto iq = [](const Samples& one) { return 1000 * deviation(one.iq_A); };
  return "| " + motor + " | `" + generation + "` | " + number("%.1f", median(specimens, speed)) +
         " | " + orders(specimens, drive.profile.drive) + " | " +
         number("%.2f", median(specimens, lag_1)) + " | " +
         (drive.profile.drive.control.has_current_loop ? number("%.0f", median(specimens, iq))
                                                       : "–") +
         " |\n";
}

}  // namespace

std::string texture_table() {
  std::string table =
      "| motor | generation | speed, dps | orders a turn (share) | lag 1 | iq, mA |\n"
      "|---|---|---|---|---|---|\n";
  for (const std::string& motor : motor_names()) {
    const protocol::Series series = profile(motor).series;
    if (series == protocol::Series::kMf || series == protocol::Series::kMh) {
      table += row(motor, "legacy") + row(motor, "v236");
    } else {
      table += row(motor, "v235");
    }
  }
  return table;
}

}  // namespace lk::test
