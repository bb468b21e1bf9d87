#pragma once

/// @file Logs of motors whose numbers are known, because they were made up here.

#include <fmt/format.h>

#include <cmath>
#include <random>
#include <string>

#include "emulator/config/candump_log.hpp"
#include "emulator/config/motor_figures.hpp"
#include "emulator/core/bus/bus.hpp"
#include "emulator/core/generation.hpp"
#include "protocol/codec.hpp"
#include "tests/support/profile.hpp"
#include "tools/identify/plan.hpp"

namespace lk::test {

/// A motor like a delivered one, with other numbers.
struct Planted {
  emulator::Profile base;  // what a user would know
  emulator::ServoConfig servo;
  double rate_Hz = 200;
  bool serial = false;  // on RS-485

  double k_t() const { return emulator::motor_figures(base).k_t_Nm_A; }
  double inertia_A_s2() const {
    const auto& m = servo.profile.drive.mechanics;
    return (m.J + (m.J_out + servo.profile.drive.load.J) / (m.gear_ratio * m.gear_ratio)) / k_t();
  }
  double coulomb_A() const {
    const auto& m = servo.profile.drive.mechanics;
    return (m.tau_coulomb + m.tau_coulomb_out / m.gear_ratio / m.gear_efficiency) / k_t();
  }
  double viscous_A_s() const { return servo.profile.drive.mechanics.B / k_t(); }
  double cogging_A() const { return servo.profile.drive.mechanics.tau_cogging / k_t(); }
  int cogging_order() const {
    return static_cast<int>(servo.profile.drive.mechanics.cogging_per_turn);
  }
};

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double between(double low, double high) {
    return low +
           (high - low) * static_cast<double>(random_()) / static_cast<double>(std::mt19937::max());
  }
  /// Between, evenly on a logarithmic scale.
  double times(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
  template <std::size_t N>
  auto& one(const auto(&of)[N]) {
    return of[random_() % N];
  }

 private:
  std::mt19937 random_;
};

inline Planted planted(unsigned seed) {
  Draw draw(seed);
  const char* const motors[] = {"mg4005", "mf7015", "mg5010", "mf9025", "mg6010"};
  const int orders[] = {12, 14, 20, 26, 28, 40, 42};
  Planted made;
  made.base = profile(draw.one(motors));
  made.servo.id = 1;
  made.servo.profile = made.base;
  made.servo.generation = emulator::Generation::kV235;
  made.servo.quirks = emulator::quirks_of(made.servo.generation);
  model::DriveParams& drive = made.servo.profile.drive;
  model::MechanicsParams& m = drive.mechanics;
  m.J *= draw.times(0.6, 4);
  const double friction = draw.times(0.6, 1.6);
  m.tau_coulomb *= friction;
  m.tau_static *= friction;
  m.B = draw.between(0.5, 8) * 1e-4 * m.tau_coulomb * 10;
  m.tau_cogging = m.tau_coulomb * draw.between(0.1, 0.5);
  do {
    m.cogging_per_turn = draw.one(orders);
  } while (m.cogging_per_turn == drive.motor.pole_pairs);  // current offsets are felt there
  drive.encoder.noise = draw.between(0.001, 0.004) * 3.14159265358979 / 180;
  drive.current_sensor.noise = draw.between(0.02, 0.08);
  drive.current_sensor.offset_a = draw.between(-0.03, 0.03);
  drive.current_sensor.offset_b = draw.between(-0.03, 0.03);
  made.servo.rom = made.servo.profile.factory;
  made.servo.boot_angle_deg = draw.between(-180, 180);
  made.rate_Hz = draw.between(100, 300);
  return made;
}

/// How a log came about.
struct Logging {
  double loss = 0.01;   // of its lines
  double jitter = 0.2;  // of the period, to either side
  double stamp_jitter_s = 20e-6;
};

/// The log of a host that follows a plan.
inline std::string plan_log(const Planted& made, unsigned seed,
                            const std::vector<emulator::PlanStep>& steps, double speed_limit_dps,
                            const Logging& how = {}) {
  using emulator::Follows;
  Draw draw(seed + 1000);
  emulator::BusConfig config;
  config.interface = "can0";
  config.seed = seed;
  config.servos.push_back(made.servo);
  if (made.serial) {
    config.serial = emulator::SerialConfig{};
    config.servos.front().quirks =
        emulator::quirks_of(made.servo.generation, protocol::Framing::kSerial);
  }
  emulator::Bus bus(config);
  const auto format = bus.servo(1).format();
  std::string log;
  double speed_dps = 0;
  double now_s = 0.2;
  const auto write = [&](emulator::SimTime at, const protocol::Frame& frame) {
    if (draw.between(0, 1) < how.loss) return;
    const auto stamp = at + std::chrono::nanoseconds(static_cast<std::int64_t>(
                                draw.between(-1, 1) * how.stamp_jitter_s * 1e9));
    log += emulator::candump_line(stamp, "can0", frame) + "\n";
  };
  const auto ask = [&](const protocol::Command& command) {
    const auto query = protocol::encode_query(1, command, format);
    const auto at =
        std::chrono::duration_cast<emulator::SimTime>(std::chrono::duration<double>(now_s));
    bus.advance_to(at);
    bus.receive({at, query});
    write(at, query);
    now_s += (1 + draw.between(-how.jitter, how.jitter)) / made.rate_Hz;
    bus.advance_to(
        std::chrono::duration_cast<emulator::SimTime>(std::chrono::duration<double>(now_s)));
    std::vector<emulator::TimedFrame> replies;
    bus.take_replies(replies);
    for (const auto& reply : replies) {
      write(reply.at, reply.frame);
      const auto decoded = protocol::decode_reply(reply.frame, format);
      const auto* content = std::get_if<protocol::ReplyFrame>(&decoded);
      if (content == nullptr) continue;
      if (const auto* state = std::get_if<protocol::State2>(&content->reply))
        speed_dps = state->speed_dps;
      if (const auto* angle = std::get_if<protocol::MultiTurnAngle>(&content->reply))
        return static_cast<double>(angle->angle_cdeg);
    }
    return 0.0;
  };
  ask(protocol::ReadState1{});
  const double start_cdeg = ask(protocol::ReadMultiTurnAngle{});
  for (const emulator::PlanStep& step : steps) {
    const double end_s = now_s + step.seconds;
    do {
      if (step.what == Follows::kTorque) {
        const bool fast = step.value * speed_dps > 0 && std::abs(speed_dps) > speed_limit_dps;
        ask(protocol::Torque{.iq_A = fast ? 0 : step.value});
      } else if (step.what == Follows::kSpeed) {
        ask(protocol::Speed{.speed_dps = step.value});
      } else {
        ask(protocol::Position2{
            .max_speed_dps = std::floor(speed_limit_dps / 2),
            .target_cdeg = static_cast<std::int32_t>(start_cdeg + step.value * 100)});
      }
    } while (now_s < end_s);
  }
  return log;
}

}  // namespace lk::test
