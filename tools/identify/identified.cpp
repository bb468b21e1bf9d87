#include "tools/identify/identified.hpp"

#include <algorithm>
#include <cmath>

#include "emulator/config/motor_figures.hpp"
#include "emulator/core/servo/registers.hpp"
#include "model/control/motion_loops.hpp"

namespace lk::emulator {
namespace {

/// Of samples at rest: fewer say little of noise (assumed).
constexpr double kFewestAtRest = 50;
constexpr double kRest_rad_s = 1;

const TrackOrder* order_at(const Track& track, std::size_t sample) {
  const auto next =
      std::ranges::upper_bound(track.orders, track.samples[sample].time_s, {}, &TrackOrder::time_s);
  return next == track.orders.begin() ? nullptr : &*(next - 1);
}

/// The deviation of iq where the drive rests and is told no torque.
std::optional<Estimate> current_noise_A(const IdentifiedDrive& drive) {
  const Track& track = drive.track;
  const double lsb_A =
      protocol::wire_format(track.servo.quirks.dialect, track.servo.profile.series).iq_reply_lsb_A;
  double squares = 0;
  double count = 0;
  double sum = 0;
  for (std::size_t n = 2; n < track.samples.size(); ++n) {
    const TrackOrder* const before = order_at(track, n - 2);
    const TrackOrder* const now = order_at(track, n);
    const auto is_free = [lsb_A](const TrackOrder* order) {
      return order != nullptr && order->what == Follows::kTorque && std::abs(order->value) < lsb_A;
    };
    if (!is_free(before) || !is_free(now)) continue;
    if (std::abs(track.samples[n].speed_rad_s) > kRest_rad_s) continue;
    sum += track.samples[n].iq_A;
    squares += track.samples[n].iq_A * track.samples[n].iq_A;
    count += 1;
  }
  if (count < kFewestAtRest) return std::nullopt;
  const double variance = squares / count - std::pow(sum / count, 2);
  const double real = std::sqrt(std::max(variance - lsb_A * lsb_A / 12, 0.0));
  return Estimate{real, 1.96 * real / std::sqrt(2 * count)};
}

/// (1 − η²)/(1 + η²) is what the balance has found of a gear.
std::optional<Estimate> gear_loss(const IdentifiedDrive& drive) {
  if (!drive.balance || !drive.balance->gear_loss) return std::nullopt;
  const Estimate& found = *drive.balance->gear_loss;
  const double x = std::clamp(found.value, 0.0, 0.99);
  const double eta = std::sqrt((1 - x) / (1 + x));
  return Estimate{1 - eta, found.half_width / ((1 + x) * (1 + x) * eta)};
}

double k_t_of(const ServoConfig& servo) { return motor_figures(servo.profile).k_t_Nm_A; }
const model::DriveParams& drive_of(const ServoConfig& servo) { return servo.profile.drive; }
model::MotionParams loops_of(const ServoConfig& servo) {
  return model::motion_params(servo.profile.drive, control_settings(servo.rom));
}

using Found = std::optional<Estimate>;
using D = const IdentifiedDrive&;
using S = const ServoConfig&;

constexpr const char* kPlan = "lk-emu identify --plan";
constexpr const char* kBalance = "balance of torques";
constexpr const char* kRipple = "answer to cogging at steady speeds";
constexpr const char* kLimit = "iq over speed at the limit of the voltage";
constexpr const char* kLimitRun = "0xA1 with a large current from rest to full speed, shaft free";
constexpr const char* kLimitRunV = "the same with 0x9A among the queries";

// One row a quantity.
// clang-format off
constexpr Quantity kQuantities[] = {
    {"inertia_A_s2_rad", "inertia at the rotor", "A·s²/rad", kBalance, kPlan,
     [](D d) { return d.balance ? Found(d.balance->inertia_A_s2) : Found(); },
     [](S s) { const auto& m = drive_of(s).mechanics; return (m.J + m.J_out / (m.gear_ratio * m.gear_ratio)) / k_t_of(s); }},
    {"coulomb_A", "Coulomb friction", "A", kBalance, "turning both ways at steady speeds (0xA2)",
     [](D d) { return d.balance ? Found(d.balance->coulomb_A) : Found(); },
     [](S s) { const auto& m = drive_of(s).mechanics; return (m.tau_coulomb + m.tau_coulomb_out / m.gear_ratio / m.gear_efficiency) / k_t_of(s); }},
    {"viscous_A_s_rad", "viscous friction", "A·s/rad", kBalance, "steady speeds (0xA2), the fastest ten times the slowest and more",
     [](D d) { return d.balance ? Found(d.balance->viscous_A_s) : Found(); },
     [](S s) { return drive_of(s).mechanics.B / k_t_of(s); }},
    {"cogging_A", "cogging", "A", kBalance, "slow, steady turning (0xA2), a turn or more",
     [](D d) { return d.cogging() != nullptr ? Found(d.cogging()->amplitude_A) : Found(); },
     [](S s) { return drive_of(s).mechanics.tau_cogging / k_t_of(s); }},
    {"gravity_A", "gravity of what hangs on the output", "A", kBalance, "slow moves (0xA2, 0xA4) over 60 degrees of the output and more",
     [](D d) { return d.balance ? d.balance->gravity_A : Found(); },
     [](S) { return 0.0; }, false},
    {"gear_loss", "share that the gear takes", "", "what gravity takes up and gives down", "slow moves up and down with a load on an arm",
     gear_loss,
     [](S s) { return 1 - drive_of(s).mechanics.gear_efficiency; }},
    {"speed_kp_A_s_rad", "Kp of the speed loop", "A·s/rad", kRipple, kPlan,
     [](D d) { return d.speed_loop.kp_A_s; },
     [](S s) { return loops_of(s).speed_kp; }},
    {"speed_ki_A_rad", "Ki of the speed loop", "A/rad", kRipple, "steady speeds (0xA2) of 30 to 200 degrees per second",
     [](D d) { return d.speed_loop.ki_A; },
     [](S s) { return loops_of(s).speed_ki; }},
    {"angle_kp_per_s", "Kp of the position loop", "1/s", "moves, emulated", "moves (0xA4) with rests between them, no arm, 200 exchanges per second",
     [](D d) { return d.position_loop ? Found(d.position_loop->angle_kp_per_s) : Found(); },
     [](S s) { return loops_of(s).angle_kp; }},
    // iq is made of two measured phases: their noise times √(4/3), in the mean over angles.
    {"iq_noise_A", "noise of the reported current", "A", "iq at rest with torque 0", "0xA1 with torque 0 for two seconds, shaft at rest",
     current_noise_A,
     [](S s) { return drive_of(s).current_sensor.noise * std::sqrt(4.0 / 3); }},
    {"no_load_rad_s", "speed where the voltage is used up", "rad/s", kLimit, kLimitRun,
     [](D d) { return d.voltage ? Found(d.voltage->no_load_rad_s) : Found(); },
     [](S s) { return (2 * drive_of(s).inverter.duty_max - 1) * drive_of(s).supply.v_source / std::sqrt(3.0) / (k_t_of(s) / 1.5); }, false},
    {"k_t_Nm_A", "torque constant", "Nm/A", kLimit, kLimitRunV,
     [](D d) { return d.voltage ? d.voltage->k_t_Nm_A : Found(); },
     k_t_of},
    {"R_ohm", "resistance of a phase, its switch, half the supply", "ohm", kLimit, kLimitRunV,
     [](D d) { return d.voltage ? d.voltage->R_ohm : Found(); },
     [](S s) { return drive_of(s).motor.R_s + drive_of(s).inverter.R_on + drive_of(s).supply.R_source / 2; }, false},
};
// clang-format on

}  // namespace

std::span<const Quantity> quantities() { return kQuantities; }

const Quantity* find_identified(std::string_view key) {
  const auto* const found = std::ranges::find(kQuantities, key, &Quantity::key);
  return found != std::end(kQuantities) ? found : nullptr;
}

const Cogging* IdentifiedDrive::cogging() const {
  if (!balance) return nullptr;
  const auto found = std::ranges::find_if(balance->cogging, [this](const Cogging& one) {
    return one.order != track.servo.profile.drive.motor.pole_pairs;
  });
  return found != balance->cogging.end() ? &*found : nullptr;
}

const Cogging* IdentifiedDrive::offset_ripple() const {
  if (!balance) return nullptr;
  const auto found = std::ranges::find(balance->cogging, track.servo.profile.drive.motor.pole_pairs,
                                       &Cogging::order);
  return found != balance->cogging.end() ? &*found : nullptr;
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
  for (const Quantity& one : quantities()) {
    drive.values.push_back(
        {&one, has_iq ? one.found(drive) : std::nullopt, one.base(drive.track.servo)});
  }
  return drive;
}

}  // namespace lk::emulator
