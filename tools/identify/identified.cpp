#include "tools/identify/identified.hpp"

#include <algorithm>
#include <cmath>

#include "emulator/config/motor_figures.hpp"
#include "emulator/core/servo/registers.hpp"
#include "model/control/motion_loops.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kPlan = "lk-emu identify --plan";
constexpr const char* kBalance = "balance of torques";

/// iq where the drive has held a torque for a while, less what it was told.
std::optional<Estimate> current_noise_A(const Track& track) {
  double squares = 0;
  double count = 0;
  double sum = 0;
  for (std::size_t n = 2; n < track.samples.size(); ++n) {
    const auto order_at = [&](std::size_t k) {
      return std::ranges::upper_bound(track.orders, track.samples[k].time_s, {},
                                      &TrackOrder::time_s) -
             1;
    };
    if (track.orders.empty() || track.samples[n - 2].time_s < track.orders.front().time_s) continue;
    const auto now = order_at(n);
    if (now->what != Follows::kTorque) continue;
    const auto before = order_at(n - 2);
    if (before->what != Follows::kTorque || before->value != now->value) continue;
    const double off_A = track.samples[n].iq_A - now->value;
    sum += off_A;
    squares += off_A * off_A;
    count += 1;
  }
  if (count < 50) return std::nullopt;
  const double variance = squares / count - std::pow(sum / count, 2);
  const double lsb_A =
      protocol::wire_format(track.servo.quirks.dialect, track.servo.profile.series).iq_reply_lsb_A;
  const double real = std::sqrt(std::max(variance - lsb_A * lsb_A / 12, 0.0));
  // The loop answers its own noise, and iq is made of two currents by the angle (14 %, assumed).
  return Estimate{real, std::hypot(1.96 * real / std::sqrt(2 * count), 0.14 * real)};
}

void find_cogging(IdentifiedDrive& drive, std::optional<Estimate>& amplitude) {
  const int pole_pairs = drive.track.servo.profile.drive.motor.pole_pairs;
  for (const Cogging& one : drive.balance->cogging) {
    if (one.order == pole_pairs) {
      drive.offset_ripple_A = one.amplitude_A;
    } else if (drive.cogging_order == 0) {
      drive.cogging_order = one.order;
      amplitude = one.amplitude_A;
    }
  }
}

/// In the order of quantities().
std::vector<std::optional<Estimate>> estimates(IdentifiedDrive& drive) {
  std::optional<Estimate> inertia, coulomb, viscous, cogging, gravity, efficiency, angle_kp, noise;
  if (drive.balance) {
    inertia = drive.balance->inertia_A_s2;
    coulomb = drive.balance->coulomb_A;
    viscous = drive.balance->viscous_A_s;
    gravity = drive.balance->gravity_A;
    find_cogging(drive, cogging);
    if (const auto& loss = drive.balance->gear_loss; loss && gravity && is_told(*gravity)) {
      // (1 − η²)/(1 + η²) is the loss.
      const double x = std::clamp(loss->value, 0.0, 0.99);
      const double eta = std::sqrt((1 - x) / (1 + x));
      efficiency = Estimate{eta, loss->half_width / ((1 + x) * (1 + x) * eta)};
    }
  }
  if (drive.track.servo.profile.drive.control.has_current_loop) {
    noise = current_noise_A(drive.track);
  }
  if (drive.position_loop) angle_kp = drive.position_loop->angle_kp_per_s;
  std::optional<Estimate> k_t, R, no_load;
  if (drive.voltage) {
    k_t = drive.voltage->k_t_Nm_A;
    R = drive.voltage->R_ohm;
    no_load = drive.voltage->no_load_rad_s;
  }
  return {inertia,
          coulomb,
          viscous,
          cogging,
          gravity,
          efficiency,
          drive.speed_loop.kp_A_s,
          drive.speed_loop.ki_A,
          angle_kp,
          noise,
          no_load,
          k_t,
          R};
}

/// The same of the motor file, with the load that nobody knows left out.
std::vector<double> of_base(const ServoConfig& servo) {
  const model::DriveParams& drive = servo.profile.drive;
  const model::MechanicsParams& m = drive.mechanics;
  const double k_t = motor_figures(servo.profile).k_t_Nm_A;
  const double N = m.gear_ratio;
  const auto p = model::motion_params(drive, control_settings(servo.rom));
  const double p_psi = k_t / 1.5;
  const double most_V = (2 * drive.inverter.duty_max - 1) * drive.supply.v_source / std::sqrt(3.0);
  return {(m.J + m.J_out / (N * N)) / k_t,
          (m.tau_coulomb + m.tau_coulomb_out / N / m.gear_efficiency) / k_t,
          m.B / k_t,
          m.tau_cogging / k_t,
          0,
          N > 1 ? m.gear_efficiency : 0,
          p.speed_kp,
          p.speed_ki,
          p.angle_kp,
          drive.current_sensor.noise * std::sqrt(4.0 / 3),
          most_V / p_psi,
          k_t,
          drive.motor.R_s + drive.inverter.R_on + drive.supply.R_source / 2};
}

}  // namespace

const std::vector<Quantity>& quantities() {
  static const std::vector<Quantity> all{
      {"inertia_A_s2_rad", "inertia at the rotor, over k_t", "A·s²/rad", kBalance, kPlan},
      {"coulomb_A", "Coulomb friction, over k_t", "A", kBalance, kPlan},
      {"viscous_A_s_rad", "viscous friction, over k_t", "A·s/rad", kBalance,
       "steady speeds (0xA2) of which the fastest is ten times the slowest"},
      {"cogging_A", "cogging, over k_t", "A", kBalance,
       "slow, steady turning (0xA2), a turn or more"},
      {"gravity_A", "gravity of what hangs on the output, over k_t", "A", kBalance,
       "slow moves (0xA2, 0xA4) over 60 degrees of the output and more"},
      {"gear_efficiency", "efficiency of the gear", "", "what gravity takes up and gives down",
       "slow moves up and down with a load on an arm"},
      {"speed_kp_A_s_rad", "Kp of the speed loop", "A·s/rad", "answer to cogging at steady speeds",
       kPlan},
      {"speed_ki_A_rad", "Ki of the speed loop", "A/rad", "answer to cogging at steady speeds",
       "steady speeds (0xA2) of 30 to 200 degrees per second"},
      {"angle_kp_per_s", "Kp of the position loop", "1/s", "moves, emulated",
       "moves (0xA4) of 30 degrees and more with rests between them, 200 exchanges per second"},
      {"iq_noise_A", "noise of the reported current", "A", "iq at rest with torque 0",
       "0xA1 with torque 0 for two seconds, shaft at rest"},
      {"no_load_rad_s", "speed where the voltage is used up", "rad/s", "iq over speed at the limit",
       "0xA1 with a large current from rest to full speed, shaft free"},
      {"k_t_Nm_A", "torque constant", "Nm/A", "the same, and the voltage of 0x9A",
       "the same with 0x9A among the queries; or a known inertia or weight on the shaft"},
      {"R_ohm", "resistance of a phase, its switch, half the supply", "ohm",
       "the same, and the voltage of 0x9A", "the same with 0x9A among the queries"},
  };
  return all;
}

const Quantity* find_identified(std::string_view key) {
  const auto found = std::ranges::find(quantities(), key, &Quantity::key);
  return found != quantities().end() ? &*found : nullptr;
}

IdentifiedDrive identify(Track track) {
  IdentifiedDrive drive;
  drive.track = std::move(track);
  // An MS drive reports a share of the voltage in place of a current.
  const bool has_iq = drive.track.servo.profile.drive.control.has_current_loop;
  if (has_iq) drive.balance = fit_balance(drive.track);
  if (drive.balance) {
    drive.speed_loop = fit_speed_loop(drive.track, *drive.balance);
    drive.position_loop = fit_position_loop(drive.track, *drive.balance, drive.speed_loop);
  }
  if (has_iq) drive.voltage = fit_voltage(drive.track);
  const auto found = estimates(drive);
  const auto base = of_base(drive.track.servo);
  for (std::size_t n = 0; n < quantities().size(); ++n) {
    drive.values.push_back({&quantities()[n], found[n], base[n]});
  }
  return drive;
}

}  // namespace lk::emulator
