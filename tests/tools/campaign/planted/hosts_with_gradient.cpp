// Bugs that show before they do harm: the joint comes closer to what must not be.

#include <algorithm>
#include <cmath>

#include "tests/tools/campaign/planted/host_frames.hpp"
#include "tests/tools/campaign/planted/planted_case.hpp"

namespace lk::emulator::planted {
namespace {

/// Travels at a speed until the joint is where it should be. A supervisor stops it when too many
/// replies in a row are missing.
class SupervisedHost {
 public:
  explicit SupervisedHost(const HostValues& host)
      : tick_(static_cast<std::uint8_t>(setting(host, "tick", 0))) {}

  void step(SimTime, Heard heard, Frames& out) {
    ++missed_;
    for (const TimedFrame& reply : heard) {
      if (!is_reply(reply.frame)) continue;
      missed_ = 0;
      if (reply.frame.data[0] == kReadAngle && angle_deg(reply.frame) > 150) stopped_ = true;
    }
    // The bug: both count to 255 and start anew, so a count that began just before a look is as
    // small at every later one.
    if (++tick_ == 0 && missed_ > 5) stopped_ = true;
    if (tick_ % 4 == 0) out.push_back(say_speed(stopped_ ? 0 : 150));
    out.push_back(say(kReadAngle));
  }

 private:
  std::uint8_t tick_;
  std::uint8_t missed_ = 0;
  bool stopped_ = false;
};

/// Follows a ramp with a loop of its own, proportional and integral, around the drive's speed loop.
class WindUpHost {
 public:
  explicit WindUpHost(const HostValues& host)
      : ki_(setting(host, "ki", 20)), patience_(ms(setting(host, "patience_ms", 250))) {}

  void step(SimTime now, Heard heard, Frames& out) {
    for (const TimedFrame& reply : heard) {
      if (!is_reply(reply.frame)) continue;
      heard_at_ = now;
      if (reply.frame.data[0] == kReadAngle) angle_deg_ = angle_deg(reply.frame);
      if (reply.frame.data[0] == kSpeed && std::abs(speed_dps(reply.frame)) > 5) turned_at_ = now;
    }
    if (now < next_) return;
    next_ += 4ms;
    if (now - heard_at_ > 12ms) {
      out.push_back(say_speed(0));
      out.push_back(say(kReadAngle));
      return;
    }
    const double wanted_deg = std::clamp(120 * (in_s(now) - 0.1), 0.0, 90.0);
    const double error_deg = wanted_deg - angle_deg_;
    // The bug: the integral is only given up when the joint has been stuck for so long, and grows
    // until then.
    if (std::abs(error_deg) < 3) turned_at_ = now;
    if (now - turned_at_ > patience_) integral_dps_ = 0;
    integral_dps_ += ki_ * error_deg * 0.004;
    out.push_back(say_speed(12 * error_deg + integral_dps_));
    out.push_back(say(kReadAngle));
  }

 private:
  double ki_;
  SimTime patience_;
  SimTime next_{0};
  SimTime heard_at_{0};
  SimTime turned_at_{0};
  double angle_deg_ = 0;
  double integral_dps_ = 0;
};

/// Brakes along v = sqrt(2 a s) with torque of its own, and takes less current from a low supply.
class LowSupplyHost {
 public:
  explicit LowSupplyHost(const HostValues& host) : speed_dps_(setting(host, "speed_dps", 400)) {}

  void step(SimTime now, Heard heard, Frames& out) {
    for (const TimedFrame& reply : heard) {
      if (!is_reply(reply.frame)) continue;
      const protocol::Frame& frame = reply.frame;
      if (frame.data[0] == kReadAngle) angle_deg_ = angle_deg(frame);
      if (frame.data[0] == kTorque) measured_dps_ = speed_dps(frame);
      if (frame.data[0] == kReadState1) voltage_V_ = voltage_V(frame);
    }
    if (now < next_) return;
    next_ += 4ms;
    out.push_back(say(kReadAngle));
    out.push_back(say(kReadState1));
    const double left_deg = now < 50ms ? 0 : 200 - angle_deg_;
    const double wanted_dps =
        std::copysign(std::min(std::sqrt(2 * kBrake_dps2 * std::abs(left_deg)), speed_dps_),
                      left_deg) *
        std::min(std::abs(left_deg), 1.0);
    // The bug: amperes for volts. The limit falls with the voltage below 20 V, and ten times as
    // fast as was meant; nothing tells the braking curve.
    double limit_A = 6;
    if (voltage_V_ < 20) limit_A = std::max(6 - (20 - voltage_V_), 0.2);
    out.push_back(say_torque(std::clamp(0.01 * (wanted_dps - measured_dps_), -limit_A, limit_A)));
  }

 private:
  static constexpr double kBrake_dps2 = 6000;
  double speed_dps_;
  SimTime next_{0};
  double angle_deg_ = 0;
  double measured_dps_ = 0;
  double voltage_V_ = 24;
};

/// Streams a ramp of positions, less often while replies are missing.
class BackOffHost {
 public:
  explicit BackOffHost(const HostValues& host)
      : forgive_(static_cast<int>(setting(host, "forgive", 8))) {}

  void step(SimTime now, Heard heard, Frames& out) {
    for (const TimedFrame& reply : heard) {
      if (is_reply(reply.frame)) answered_ = true;
    }
    if (now < next_) return;
    if (!answered_) {
      // The bug: meant to be no more than 3, eight times the cycle.
      shift_ = std::min(shift_ + 1, 8);
      good_ = 0;
    } else if (++good_ >= forgive_) {
      shift_ = std::max(shift_ - 1, 0);
      good_ = 0;
    }
    answered_ = false;
    next_ = now + 4ms * (1 << shift_);
    out.push_back(say_move(kPosition, std::clamp(100 * (in_s(now) - 0.1), 0.0, 100.0), 0));
  }

 private:
  int forgive_;
  int shift_ = 0;
  int good_ = 0;
  bool answered_ = true;
  SimTime next_{0};
};

/// Holds an arm by torque, and takes less of it as the motor warms.
class DeratingHost {
 public:
  explicit DeratingHost(const HostValues& host) : derate_C_(setting(host, "derate_C", 70)) {}

  void step(SimTime now, Heard heard, Frames& out) {
    for (const TimedFrame& reply : heard) {
      if (!is_reply(reply.frame)) continue;
      const protocol::Frame& frame = reply.frame;
      heard_at_ = now;
      if (frame.data[0] == kReadAngle) angle_deg_ = angle_deg(frame);
      if (frame.data[0] != kTorque) continue;
      measured_dps_ = speed_dps(frame);
      temperature_C_ = static_cast<std::int8_t>(frame.data[1]);
    }
    if (now < next_) return;
    next_ += 4ms;
    if (now - heard_at_ > 12ms) {  // blind: the drive holds by itself
      out.push_back(say_speed(0));
      out.push_back(say(kReadAngle));
      return;
    }
    const double wanted_deg = std::min(100 * in_s(now), 40.0);
    // The bug: nothing keeps the share at the half that was meant to be the least.
    const double share = std::min(1 - (temperature_C_ - derate_C_) / 30, 1.0);
    const double error_deg = wanted_deg - angle_deg_;
    integral_A_ = std::clamp(integral_A_ + 1.0 * error_deg * 0.004, -4.0, 4.0);
    out.push_back(say_torque(share * (0.3 * error_deg - 0.02 * measured_dps_ + integral_A_)));
    out.push_back(say(kReadAngle));
  }

 private:
  double derate_C_;
  SimTime next_{0};
  SimTime heard_at_{0};
  double angle_deg_ = 0;
  double measured_dps_ = 0;
  double temperature_C_ = 25;
  double integral_A_ = 0;
};

/// Moves by torque, its damping from the difference of two angles.
class DifferencesHost {
 public:
  explicit DifferencesHost(const HostValues& host) : damping_(setting(host, "damping", 0.015)) {}

  void step(SimTime now, Heard heard, Frames& out) {
    for (const TimedFrame& reply : heard) {
      if (!is_reply(reply.frame) || reply.frame.data[0] != kReadAngle) continue;
      const double before_deg = angle_deg_;
      angle_deg_ = angle_deg(reply.frame);
      // The bug: the time between two replies is taken for that between two queries.
      measured_dps_ = 0.5 * measured_dps_ + 0.5 * (angle_deg_ - before_deg) / 0.003;
    }
    if (now < next_) return;
    next_ += 3ms;
    const double wanted_deg = std::clamp(200 * (in_s(now) - 0.1), 0.0, 80.0);
    const double iq_A = 0.15 * (wanted_deg - angle_deg_) - damping_ * measured_dps_;
    out.push_back(say_torque(std::clamp(iq_A, -8.0, 8.0)));
    out.push_back(say(kReadAngle));
  }

 private:
  double damping_;
  SimTime next_{0};
  double angle_deg_ = 0;
  double measured_dps_ = 0;
};

}  // namespace

std::vector<Bug> bugs_with_gradient() {
  return {
      {.name = "supervisor_counts_to_255",
       .about =
           "the count of missing replies and the clock of who looks at it wrap together: sawteeth "
           "in time, a cliff at the end of each",
       .has_gradient = true,
       .scenario = R"(
robot = "robots/axis.toml"
duration_s = 1.6
[[expect]]
says = "the joint is stopped in time"
id = 1
signal = "true_angle_deg"
min = -300
max = 192
from_s = 0
)",
       .dimensions =
           {
               {.name = "fault.kind",
                .words = {"silent", "drop", "duplicate", "delay", "load_step"}},
               {.name = "fault.at_s", .from = 0.1, .to = 1.2},
               {.name = "fault.for_s", .from = 0.02, .to = 1.2},
               {.name = "fault.probability", .from = 0.3, .to = 1},
               {.name = "fault.delay.delay_ms", .from = 0, .to = 20},
               {.name = "fault.load_step.torque_Nm", .from = -0.2, .to = 0.2},
               {.name = "host.tick", .from = 0, .to = 255, .whole = true},
           },
       .run = run_with<SupervisedHost>},
      {.name = "integral_winds_up",
       .about = "the integral of a position loop grows while the joint is stuck, and is given up a "
                "little later",
       .has_gradient = true,
       .scenario = R"(
robot = "robots/axis.toml"
duration_s = 1.4
[[expect]]
says = "the joint overshoots no further"
id = 1
signal = "true_angle_deg"
min = -200
max = 150
from_s = 0
)",
       .dimensions =
           {
               {.name = "fault.kind",
                .words = {"jam", "friction", "load_step", "duplicate", "slow_replies"}},
               {.name = "fault.at_s", .from = 0.05, .to = 1.2},
               {.name = "fault.for_s", .from = 0.02, .to = 0.5},
               {.name = "fault.jam.percent", .from = 0, .to = 100},
               {.name = "fault.friction.factor", .from = 1, .to = 40},
               {.name = "fault.load_step.torque_Nm", .from = -0.3, .to = 0.3},
               {.name = "host.ki", .from = 2, .to = 25},
           },
       .run = run_with<WindUpHost>},
      {.name = "amperes_for_volts",
       .about = "at a low supply the current for braking is limited more than was meant, a slip of "
                "units",
       .has_gradient = true,
       .scenario = R"(
robot = "robots/axis.toml"
duration_s = 1.3
[[expect]]
says = "the joint stays short of its end"
id = 1
signal = "true_angle_deg"
min = -400
max = 216
from_s = 0
)",
       .dimensions =
           {
               {.name = "fault.kind", .words = {"sag", "voltage_off", "duplicate", "encoder_slow"}},
               {.name = "fault.at_s", .from = 0.05, .to = 1.2},
               {.name = "fault.for_s", .from = 0.02, .to = 0.5},
               {.name = "fault.sag.to_V", .from = 15, .to = 24},
               {.name = "fault.voltage_off.offset_V", .from = -8, .to = 8},
               {.name = "supply_V", .from = 20, .to = 28},
               {.name = "load.J_g_cm2", .from = 2000, .to = 20000},
           },
       .run = run_with<LowSupplyHost>},
      {.name = "back_off_too_far",
       .about = "missing replies make a stream of positions slower, without the end that was meant",
       .has_gradient = true,
       .scenario = R"(
robot = "robots/axis.toml"
duration_s = 1.4
[[expect]]
says = "the joint follows smoothly"
id = 1
signal = "true_speed_dps"
min = -400
max = 390
from_s = 0
)",
       .dimensions =
           {
               {.name = "fault.kind",
                .words = {"drop", "reorder", "duplicate", "stale", "slow_replies"}},
               {.name = "fault.at_s", .from = 0.05, .to = 1.2},
               {.name = "fault.for_s", .from = 0.01, .to = 0.35},
               {.name = "fault.probability", .from = 0.1, .to = 1},
               {.name = "fault.drop.frames", .words = {"replies", "queries", "both"}},
               {.name = "seed", .from = 1, .to = 1000, .whole = true},
               {.name = "host.forgive", .from = 2, .to = 12, .whole = true},
           },
       .run = run_with<BackOffHost>},
      {.name = "derated_to_nothing",
       .about = "a warm motor is given less torque, without the least that was meant",
       .has_gradient = true,
       .scenario = R"(
robot = "robots/arm.toml"
duration_s = 1.3
[[expect]]
says = "the arm is held"
id = 1
signal = "true_angle_deg"
min = 15
max = 65
from_s = 0.6
)",
       .dimensions =
           {
               {.name = "fault.kind",
                .words = {"temperature_stuck", "temperature_off", "reorder", "duplicate",
                          "slow_replies"}},
               {.name = "fault.at_s", .from = 0.05, .to = 1.2},
               {.name = "fault.for_s", .from = 0.02, .to = 1},
               {.name = "fault.temperature_stuck.value_C", .from = -40, .to = 98},
               {.name = "fault.temperature_off.offset_C", .from = -40, .to = 55},
               {.name = "ambient_C", .from = 10, .to = 40},
               {.name = "load.tau_gravity_Nm", .from = 0.1, .to = 0.6},
           },
       .run = run_with<DeratingHost>},
      {.name = "differences_of_late_replies",
       .about = "a loop takes its damping from angles whose times it assumes",
       .has_gradient = true,
       .scenario = R"(
robot = "robots/axis.toml"
duration_s = 1.3
[[expect]]
says = "the joint stays on its way"
id = 1
signal = "true_angle_deg"
min = -200
max = 155
from_s = 0
)",
       .dimensions =
           {
               {.name = "fault.kind",
                .words = {"delay", "slow_replies", "reorder", "duplicate", "adapter_batch"}},
               {.name = "fault.at_s", .from = 0.05, .to = 1.2},
               {.name = "fault.for_s", .from = 0.02, .to = 0.5},
               {.name = "fault.delay.delay_ms", .from = 0, .to = 12},
               {.name = "fault.slow_replies.delay_ms", .from = 0.1, .to = 12},
               {.name = "load.J_g_cm2", .from = 500, .to = 4000},
               {.name = "host.damping", .from = 0.005, .to = 0.03},
           },
       .run = run_with<DifferencesHost>},
  };
}

std::vector<Bug> all_bugs() {
  std::vector<Bug> all = bugs_with_gradient();
  for (Bug& bug : bugs_without_gradient()) all.push_back(std::move(bug));
  return all;
}

}  // namespace lk::emulator::planted
