#include "tests/fidelity/joint_log.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/profile.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::test {
namespace {

using std::chrono::microseconds;

constexpr microseconds kSampling{12'000};
constexpr double kIqLsb_A = 33.0 / 2048.0;

/// The model has one spring, used for the load here: the gear's is a hundred times stiffer.
void hang(const JointLoad& load, model::DriveParams& drive) {
  if (load.sprung_kg_m2 == 0) {
    drive.load.J = load.rigid_kg_m2;
    return;
  }
  model::MechanicsParams& m = drive.mechanics;
  const double omega = 2 * std::numbers::pi * load.sprung_Hz;
  m.J += load.rigid_kg_m2 / (m.gear_ratio * m.gear_ratio);
  m.J_out = load.sprung_kg_m2;
  m.gear_stiffness_out = load.sprung_kg_m2 * omega * omega;
  m.gear_damping_out = 2 * load.damping * omega * load.sprung_kg_m2;
  m.backlash_out = 0;
  m.tau_coulomb_out = 0;
  m.gear_efficiency = 1;
}

emulator::BusConfig joint(std::uint64_t seed, const JointLoad& load, emulator::Specimen specimen) {
  emulator::ServoConfig servo;
  servo.id = 1;
  servo.profile = profile("mg4005-14p");
  hang(load, servo.profile.drive);
  servo.rom = servo.profile.factory;
  servo.rom.gains = {100, 100, 40, 14, 50, 50};
  servo.specimen = specimen;
  servo.boot_angle_deg = 10.0 + 13.0 * static_cast<double>(seed);
  emulator::BusConfig config = bus_config({});
  config.seed = seed;
  config.servos.push_back(servo);
  return config;
}

/// The pause before sample `n` of a host with this jitter.
class Sampling {
 public:
  Sampling(std::uint64_t seed, int jitter_us) : dice_(2463534242U + seed), jitter_us_(jitter_us) {}
  microseconds next() {
    dice_ = dice_ * 6364136223846793005U + 1442695040888963407U;
    const int early_us = late_us_;
    late_us_ = jitter_us_ > 0
                   ? static_cast<int>((dice_ >> 33U) % static_cast<std::uint64_t>(2 * jitter_us_)) -
                         jitter_us_
                   : 0;
    return kSampling + microseconds(late_us_ - early_us);
  }

 private:
  std::uint64_t dice_;
  int jitter_us_;
  int late_us_ = 0;
};

}  // namespace

std::vector<double> JointLog::pick(std::size_t from, std::size_t to,
                                   double JointSample::*field) const {
  std::vector<double> values;
  for (std::size_t n = from; n < to; ++n) values.push_back(samples.at(n).*field);
  return values;
}

JointLog move_joint(std::uint64_t seed, int jitter_us, const JointLoad& load,
                    emulator::Specimen specimen) {
  Host host(joint(seed, load, specimen));
  host.wait(std::chrono::milliseconds(200));
  const auto target_cdeg = host.multi_turn_cdeg() - 60000;
  host.get<protocol::State2>(
      protocol::Position2{.max_speed_dps = static_cast<std::uint16_t>(kLimit_dps),
                          .target_cdeg = static_cast<std::int32_t>(target_cdeg)});
  // 65536 counts span one output turn, ten rotor turns (360000 hundredths of a degree).
  const auto target_counts =
      static_cast<int>(std::lround(static_cast<double>(target_cdeg) * 65536 / 360000));
  JointLog log;
  Sampling sampling(seed, jitter_us);
  for (std::size_t n = 0; n < kTravelSamples + kHoldSamples; ++n) {
    host.wait(sampling.next());
    const auto state = host.state_2();
    const auto error = static_cast<std::int16_t>(state.encoder_counts - target_counts);
    log.samples.push_back(
        {state.speed_dps, std::round(state.iq_A / kIqLsb_A), error, error * 10.0 / 65536});
  }
  const auto slower =
      std::find_if(log.samples.begin() + 40, log.samples.end(),
                   [](const JointSample& s) { return std::abs(s.speed_dps) < 0.8 * kLimit_dps; });
  log.stop_begins = static_cast<std::size_t>(slower - log.samples.begin());
  return log;
}

JointLog track_joint(std::uint64_t seed, double from_dps, double to_dps, std::size_t samples) {
  Host host(joint(seed, {}, emulator::Specimen::kDrawn));
  host.wait(std::chrono::milliseconds(200));
  JointLog log;
  Sampling sampling(seed, kJitter_us);
  constexpr std::size_t kRunUp = 20;
  for (std::size_t n = 0; n < kRunUp + samples; ++n) {
    const double share =
        n < kRunUp ? 0 : static_cast<double>(n - kRunUp) / static_cast<double>(samples);
    const double limit_dps = std::round(from_dps + share * (to_dps - from_dps));
    const auto target_cdeg = static_cast<std::int32_t>(host.multi_turn_cdeg() + 7000);
    host.get<protocol::State2>(
        protocol::Position2{.max_speed_dps = limit_dps, .target_cdeg = target_cdeg});
    host.wait(sampling.next());
    const auto state = host.state_2();
    if (n < kRunUp) continue;
    log.samples.push_back({state.speed_dps - limit_dps, std::round(state.iq_A / kIqLsb_A), 0, 0});
  }
  return log;
}

const std::vector<JointLog>& joint_moves() {
  static const std::vector<JointLog> kLogs = [] {
    std::vector<JointLog> logs;
    for (std::uint64_t seed = 1; seed <= kMoves; ++seed) {
      logs.push_back(move_joint(seed, kJitter_us, {}, emulator::Specimen::kDrawn));
    }
    return logs;
  }();
  return kLogs;
}

}  // namespace lk::test
