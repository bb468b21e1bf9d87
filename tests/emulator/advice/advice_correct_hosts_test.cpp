// Randomised correct hosts: each reads the angle after every event, and moves from there.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/emulator/advice/advice_support.hpp"
#include "tests/emulator/core/core_support.hpp"
#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace advice_correct_hosts_test {

constexpr AdviceKind kNew[] = {AdviceKind::kLunge,           AdviceKind::kLeftTurning,
                               AdviceKind::kFirstTargetZero, AdviceKind::kTargetWrapped,
                               AdviceKind::kAnswersShifted,  AdviceKind::kStaleBacklog};

/// One run of a host with its own rate, jitter, stalls and bursts, on a random drive.
class CorrectHost {
 public:
  /// `reads`: false for a host that never reads the angle.
  explicit CorrectHost(unsigned seed, bool reads = true)
      : random_(seed), reads_(reads), config_(make_config()), bus_(config_), adviser_(config_) {}

  /// Returns the advice of the new kinds.
  std::string run() {
    period_ = std::chrono::microseconds(pick(1000, 20'000));
    trajectory_ = chance(0.5);
    const bool bursts = chance(0.3);
    read_angle();
    for (int n = pick(1, 5); n > 0; --n) {
      move();
      if (chance(0.6)) event();
      if (bursts) {
        for (int burst = pick(2, 6); burst > 0; --burst) send(protocol::ReadState2{}, 100us);
        wait(period_);
      }
    }
    send(protocol::Stop{}, 2s);
    std::string text;
    for (const Advice& advice : adviser_.advice()) {
      if (std::ranges::find(kNew, advice.found.kind) == std::end(kNew)) continue;
      text += advice_line("bus", advice, Language::kEnglish) + '\n';
    }
    return text;
  }
  double way_deg() const { return way_deg_; }

 private:
  int pick(int least, int most) { return std::uniform_int_distribution<int>(least, most)(random_); }
  double draw(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random_);
  }
  bool chance(double share) { return draw(0, 1) < share; }

  BusConfig make_config() {
    const Generation generation = chance(0.5) ? Generation::kLegacy : Generation::kV236;
    BusConfig config = test::bus_config({}, 1'000'000);
    ServoConfig servo = test::drive(generation);
    servo.boot_angle_deg = draw(-3000, 3000);
    if (chance(0.5)) servo.profile.drive.mechanics.gear_ratio = pick(2, 36);
    gear_ = servo.profile.drive.mechanics.gear_ratio;
    if (chance(0.3)) servo.profile.drive.load.tau_gravity = 0.2;
    config.servos.push_back(servo);
    return config;
  }

  void wait(SimTime duration) {
    const SimTime end = bus_.time() + duration;
    while (bus_.time() < end) {
      bus_.advance_to(std::min(end, bus_.time() + Adviser::kObservePeriod));
      for (const TimedFrame& reply : test::replies_of(bus_)) {
        adviser_.on_reply(reply);
        take(reply.frame);
      }
      adviser_.observe(bus_);
    }
  }
  void take(const protocol::Frame& frame) {
    const auto decoded = protocol::decode_reply(frame, bus_.servo(1).format);
    const auto* reply = std::get_if<protocol::ReplyFrame>(&decoded);
    if (reply == nullptr) return;
    if (const auto* angle = std::get_if<protocol::MultiTurnAngle>(&reply->reply)) {
      angle_deg_ = static_cast<double>(angle->angle_cdeg) / 100;
    }
  }
  void send(const protocol::Command& command, SimTime gap) {
    const TimedFrame in{bus_.time(), protocol::encode_query(1, command, bus_.servo(1).format)};
    adviser_.on_query(in);
    bus_.receive(in);
    wait(gap);
  }
  /// A cycle of the host, with jitter.
  void cycle(const protocol::Command& command) {
    send(command, std::chrono::microseconds(static_cast<int>(static_cast<double>(period_.count()) /
                                                             1000 * draw(0.7, 1.5))));
  }
  void read_angle() {
    if (reads_) cycle(protocol::ReadMultiTurnAngle{});
  }

  void move_to(double target_deg) {
    cycle(protocol::Position1{static_cast<std::int32_t>(std::lround(100 * target_deg))});
  }
  /// Moves by up to 20 turns of the output, in one step or along a path.
  void move() {
    const double way_deg = gear_ * std::exp(draw(0, std::log(7200.0))) * (chance(0.5) ? 1 : -1);
    way_deg_ += std::abs(way_deg);
    const double from_deg = angle_deg_;
    const int steps = pick(20, 60);
    if (chance(0.2)) {
      const auto speed_cdps = static_cast<int>(draw(-300, 300) * gear_);
      for (int n = 0; n < steps; ++n) cycle(protocol::Speed{static_cast<double>(speed_cdps), 0});
      send(protocol::Stop{}, period_);
      read_angle();
      return;
    }
    for (int n = 1; n <= steps; ++n) {
      move_to(from_deg + (trajectory_ ? way_deg * n / steps : way_deg));
      if (chance(0.02)) stall();
      if (chance(0.1)) cycle(protocol::ReadState2{});
    }
    read_angle();
  }
  /// After a stall of more than five periods, the host reads the angle. Then it moves on.
  void stall() {
    wait(period_ * pick(1, 30));
    read_angle();
  }
  void event() {
    switch (pick(0, 6)) {
      case 0:
        send(protocol::Off{}, period_);
        send(protocol::Run{}, period_);
        break;
      case 1:  // a legacy drive would resume its old target: off first
        send(protocol::Stop{}, period_);
        turn();
        send(protocol::Off{}, period_);
        send(protocol::Run{}, period_);
        break;
      case 2:
        bus_.power_cycle(1);
        wait(50ms);
        break;
      case 3:
        bus_.apply({kWholeBus, SetFault{test::fault("encoder_jump", {draw(-90, 90)})}});
        break;
      case 4:  // the host sends no motion until an answer comes
        bus_.apply(
            {kWholeBus, SetFault{test::fault("no_ack", {}, {.duration = SimTime(300ms)}, {})}});
        for (int n = 0; n < 20; ++n) read_angle();
        wait(400ms);
        break;
      case 5:
        bus_.apply({kWholeBus,
                    SetFault{test::fault("delay", {draw(1, 40)}, {.duration = SimTime(20ms)})}});
        wait(100ms);
        break;
      default:
        wait(1s);  // silence
        break;
    }
    read_angle();
  }
  void turn() {
    bus_.apply({1, TurnShaft{draw(-120, 120)}});
    wait(period_);
  }

  std::mt19937 random_;
  bool reads_;
  double gear_ = 1;
  BusConfig config_;
  Bus bus_;
  Adviser adviser_;
  SimTime period_{0};
  bool trajectory_ = false;
  double angle_deg_ = 0;
  double way_deg_ = 0;
};

TEST(AdviceCorrectHosts, GetNoAdviceOnUnaskedMotion) {
  constexpr int kRuns = 200;
  int blamed = 0;
  std::string text;
  double way_deg = 0;
  for (int n = 0; n < kRuns; ++n) {
    CorrectHost host(static_cast<unsigned>(n));
    const std::string advice = host.run();
    way_deg += host.way_deg();
    if (advice.empty()) continue;
    ++blamed;
    text += "run " + std::to_string(n) + ": " + advice;
  }
  EXPECT_GT(way_deg, 1000.0 * kRuns) << "the hosts move";
  EXPECT_EQ(blamed, 0) << text;
}

TEST(AdviceCorrectHosts, TheSameHostsGetAdviceIfTheyNeverReadTheAngle) {
  constexpr int kRuns = 20;
  int blamed = 0;
  for (int n = 0; n < kRuns; ++n) {
    blamed += CorrectHost(static_cast<unsigned>(n), false).run().empty() ? 0 : 1;
  }
  EXPECT_GT(blamed, kRuns / 2);
}

}  // namespace advice_correct_hosts_test
}  // namespace lk::emulator
