/// @file Motors that are known because they were made up, and what is found of them in their logs.
/// LKEMU_PLANTED_MOTORS=200 tries as many (docs/identify.md has what came of that).

#include "tests/tools/identify/planted.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "emulator/core/servo/registers.hpp"
#include "model/control/motion_loops.hpp"
#include "tests/support/sanitizer.hpp"
#include "tools/identify/identified.hpp"

namespace lk::test {
namespace {

constexpr unsigned kMotors = 20;
constexpr std::size_t kFewestForAMedian = 10;
/// Under sanitizers two, for what they find; numbers are judged where there are enough of them.
unsigned motors() {
  const char* const many = std::getenv("LKEMU_PLANTED_MOTORS");  // NOLINT(concurrency-mt-unsafe)
  if (many != nullptr) return static_cast<unsigned>(std::atoi(many));
  return kAddressSanitizer ? 2 : kMotors;
}

/// What is true of a planted motor, by the keys of what is identified.
std::map<std::string, double> truth(const Planted& made) {
  const auto loops =
      model::motion_params(made.servo.profile.drive, emulator::control_settings(made.servo.rom));
  return {{"inertia_A_s2_rad", made.inertia_A_s2()}, {"coulomb_A", made.coulomb_A()},
          {"viscous_A_s_rad", made.viscous_A_s()},   {"cogging_A", made.cogging_A()},
          {"speed_kp_A_s_rad", loops.speed_kp},      {"speed_ki_A_rad", loops.speed_ki},
          {"angle_kp_per_s", loops.angle_kp}};
}

/// How likely as few hits are of `tries` that each hit with 95 %.
double binomial(int hits, int tries) {
  double sum = 0;
  for (int k = 0; k <= hits; ++k) {
    sum += std::exp(std::lgamma(tries + 1) - std::lgamma(k + 1) - std::lgamma(tries - k + 1) +
                    k * std::log(0.95) + (tries - k) * std::log(0.05));
  }
  return sum;
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

struct Found {
  std::vector<double> errors;
  int inside = 0;
};

/// 30 s of a plan, 100 to 300 exchanges a second with jitter, one line in a hundred lost.
TEST(PlantedMotors, AreFoundInLogsOfPlans) {
  std::map<std::string, Found> found;
  int orders = 0;
  for (unsigned seed = 1; seed <= motors(); ++seed) {
    const Planted made = planted(seed);
    const auto limits = emulator::plan_limits(made.base);
    const std::string log =
        plan_log(made, seed, emulator::plan_steps(limits), 2 * limits.speed_dps);
    auto tracks = emulator::read_tracks(log, {.base = made.base, .generation = {}, .id = {}});
    ASSERT_EQ(tracks.size(), 1U);
    const auto drive = emulator::identify(std::move(tracks.front()));
    ASSERT_TRUE(drive.balance) << seed;
    EXPECT_LE(drive.balance->check.held_out_ratio, 1.2) << seed;
    orders += drive.cogging() != nullptr && drive.cogging()->order == made.cogging_order() ? 1 : 0;
    const auto known = truth(made);
    for (const auto& one : drive.values) {
      const std::string key(one.quantity->key);
      if (!one.estimate || !emulator::is_told(*one.estimate)) continue;
      // Nothing that a log of a free shaft cannot tell.
      EXPECT_TRUE(known.contains(key) || key == "iq_noise_A") << key;
      if (!known.contains(key)) continue;
      const double error = one.estimate->value - known.at(key);
      found[key].errors.push_back(std::abs(error / known.at(key)));
      if (std::abs(error) <= one.estimate->half_width) ++found[key].inside;
    }
  }
  if (motors() < kMotors) return;
  // Of one in twenty the cogging may be too fast for the log.
  EXPECT_GE(orders, static_cast<int>(0.95 * motors()));
  for (const auto& [key, one] : found) {
    const int tries = static_cast<int>(one.errors.size());
    // What few motors tell is judged where there are more of them: a median of three is luck.
    if (one.errors.size() >= kFewestForAMedian) {
      EXPECT_LE(median(one.errors), 0.05) << key;
    }
    EXPECT_GE(binomial(one.inside, tries), 0.01) << key << ": " << one.inside << " of " << tries;
    RecordProperty(key, std::to_string(median(one.errors)) + ", inside " +
                            std::to_string(one.inside) + " of " + std::to_string(tries));
  }
  // Each motor has these.
  for (const char* key : {"inertia_A_s2_rad", "coulomb_A", "cogging_A"}) {
    EXPECT_GE(found[key].errors.size(), 0.9 * motors()) << key;
  }
}

/// A robot at work, 12 ms from one 0xA4 to the next: friction and cogging show, and J does with
/// k_t, or not at all.
TEST(PlantedMotors, TellOfALogOfMovesWhatItHas) {
  Planted made = planted(4);
  made.rate_Hz = 83;
  std::vector<emulator::PlanStep> steps;
  for (int n = 0; n < 12; ++n) {
    steps.push_back({emulator::Follows::kPosition, n % 2 == 0 ? 900.0 : 0.0, 2.5});
  }
  const std::string log = plan_log(made, 4, steps, 1000);
  auto tracks = emulator::read_tracks(log, {.base = made.base, .generation = {}, .id = {}});
  ASSERT_EQ(tracks.size(), 1U);
  const auto drive = emulator::identify(std::move(tracks.front()));
  const auto known = truth(made);
  for (const auto& one : drive.values) {
    const std::string key(one.quantity->key);
    const bool told = one.estimate && emulator::is_told(*one.estimate);
    if (key == "k_t_Nm_A" || key == "R_ohm" || key == "gravity_A") {
      EXPECT_FALSE(told) << key;
    }
    if (key == "coulomb_A") {
      EXPECT_TRUE(told);
    }
    if (told && known.contains(key)) {
      EXPECT_NEAR(one.estimate->value, known.at(key), 2 * one.estimate->half_width) << key;
    }
  }
}

/// Twice the J, the friction and the k_t: the same log, and so the same numbers.
TEST(PlantedMotors, ShowTorquesOnlyAsRatios) {
  const auto identified = [](double factor) {
    Planted made = planted(16);
    model::DriveParams& drive = made.servo.profile.drive;
    drive.motor.psi_f *= factor;
    for (double* torque : {&drive.mechanics.J, &drive.mechanics.J_out, &drive.mechanics.tau_coulomb,
                           &drive.mechanics.tau_static, &drive.mechanics.tau_coulomb_out,
                           &drive.mechanics.B, &drive.mechanics.tau_cogging}) {
      *torque *= factor;
    }
    drive.control.J_nominal *= factor;
    drive.mechanics.gear_stiffness_out *= factor;
    drive.mechanics.gear_damping_out *= factor;
    const auto limits = emulator::plan_limits(made.base);
    const std::string log = plan_log(made, 16, emulator::plan_steps(limits), 2 * limits.speed_dps);
    auto tracks = emulator::read_tracks(log, {.base = made.base, .generation = {}, .id = {}});
    return emulator::identify(std::move(tracks.at(0)));
  };
  const auto once = identified(1);
  const auto twice = identified(2);
  for (std::size_t n = 0; n < 2; ++n) {  // inertia and friction
    ASSERT_TRUE(once.values[n].estimate && twice.values[n].estimate);
    EXPECT_NEAR(
        twice.values[n].estimate->value, once.values[n].estimate->value,
        std::hypot(once.values[n].estimate->half_width, twice.values[n].estimate->half_width));
  }
}

/// Told more current than the voltage lets through, a drive shows R and k_t.
TEST(PlantedMotors, ShowTheirWindingsAtTheLimitOfTheVoltage) {
  Planted made = planted(2);
  ASSERT_EQ(made.base.drive.mechanics.gear_ratio, 1);
  made.servo.profile.drive.mechanics.J *= 60;  // a wheel: it takes its time
  made.servo.profile.drive.motor.R_s *= 1.3;
  made.servo.profile.drive.motor.psi_f *= 0.9;
  const auto& drive = made.servo.profile.drive;
  std::vector<emulator::PlanStep> steps;
  for (int n = 0; n < 6; ++n) {
    steps.push_back({emulator::Follows::kTorque, n % 2 == 0 ? 8.0 : -8.0, 4});
  }
  const std::string log = plan_log(made, 2, steps, 1e9);
  auto tracks = emulator::read_tracks(log, {.base = made.base, .generation = {}, .id = {}});
  const auto found = emulator::identify(std::move(tracks.at(0)));
  ASSERT_TRUE(found.voltage && found.voltage->k_t_Nm_A && found.voltage->R_ohm);
  const double k_t = 1.5 * drive.motor.pole_pairs * drive.motor.psi_f;
  EXPECT_NEAR(found.voltage->k_t_Nm_A->value, k_t, 0.05 * k_t);
  const double R = drive.motor.R_s + drive.inverter.R_on + drive.supply.R_source / 2;
  EXPECT_NEAR(found.voltage->R_ohm->value, R, 0.05 * R);
}

/// The packets of RS-485 say the same.
TEST(PlantedMotors, AreFoundOnRs485) {
  Planted made = planted(4);
  made.serial = true;
  const auto limits = emulator::plan_limits(made.base);
  const std::string log = plan_log(made, 4, emulator::plan_steps(limits), 2 * limits.speed_dps);
  EXPECT_NE(log.find("rs485#3E"), std::string::npos);
  auto tracks = emulator::read_tracks(log, {.base = made.base, .generation = {}, .id = {}});
  ASSERT_EQ(tracks.size(), 1U);
  const auto drive = emulator::identify(std::move(tracks.front()));
  ASSERT_TRUE(drive.balance);
  EXPECT_NEAR(drive.balance->inertia_A_s2.value, made.inertia_A_s2(), 0.05 * made.inertia_A_s2());
  ASSERT_TRUE(drive.cogging() != nullptr);
  EXPECT_EQ(drive.cogging()->order, made.cogging_order());
}

/// An arm on the output: gravity and what the gear takes.
TEST(PlantedMotors, ShowTheArmThatHangsOnThem) {
  Planted made = planted(4);  // geared
  ASSERT_GT(made.base.drive.mechanics.gear_ratio, 1);
  made.servo.profile.drive.load.tau_gravity = 1.5;
  made.servo.profile.drive.load.J = 0.02;
  std::vector<emulator::PlanStep> steps;
  for (int n = 0; n < 8; ++n) {
    steps.push_back({emulator::Follows::kPosition, n % 2 == 0 ? 1200.0 : -1200.0, 3.5});
  }
  const std::string log = plan_log(made, 4, steps, 1440);
  auto tracks = emulator::read_tracks(log, {.base = made.base, .generation = {}, .id = {}});
  const auto drive = emulator::identify(std::move(tracks.at(0)));
  ASSERT_TRUE(drive.balance && drive.balance->gravity_A);
  const double N = made.base.drive.mechanics.gear_ratio;
  const double eta = made.base.drive.mechanics.gear_efficiency;
  // The mean of what lifting takes and lowering gives back.
  const double gravity_A = 1.5 / N * (1 / eta + eta) / 2 / made.k_t();
  EXPECT_NEAR(drive.balance->gravity_A->value, gravity_A, 0.05 * gravity_A);
  for (const auto& one : drive.values) {
    if (one.quantity->key != "gear_loss") continue;
    ASSERT_TRUE(one.estimate);
    EXPECT_NEAR(one.estimate->value, 1 - eta, 0.05);
  }
}

}  // namespace
}  // namespace lk::test
