// Bugs that need the very case: until then the joint does what it always does.

#include <cmath>
#include <optional>

#include "tests/tools/campaign/planted/host_frames.hpp"
#include "tests/tools/campaign/planted/planted_case.hpp"

namespace lk::emulator::planted {
namespace {

/// Travels at a speed, and docks by position from a given moment on. What is not answered within
/// its cycle is said again.
class DockingHost {
 public:
  explicit DockingHost(const HostValues& host) : dock_at_(ms(setting(host, "dock_ms", 600))) {}

  void step(SimTime now, Heard heard, Frames& out) {
    for (const TimedFrame& reply : heard) {
      if (is_reply(reply.frame)) answered_ = true;
    }
    if (now < next_) return;
    next_ += 5ms;
    if (!answered_) {
      out.push_back(last_);
      return;
    }
    answered_ = false;
    if (docking_) {
      last_ = say(kReadState2);
    } else if (now >= dock_at_) {
      docking_ = true;
      // The bug: the one command that is not cyclic goes out past `last_`, so when its reply is
      // missing the travel at a speed is commanded anew, and nothing after that ends it.
      out.push_back(say_move(kPosition, 180, 300));
      return;
    } else {
      last_ = say_speed(now < 50ms ? 0 : 200);
    }
    out.push_back(last_);
  }

 private:
  SimTime dock_at_;
  SimTime next_{0};
  protocol::Frame last_ = say(kReadState2);
  bool answered_ = true;
  bool docking_ = false;
};

/// Seeks its home backwards, lets the joint settle there, and goes to work. A drive that trips is
/// cleared, switched on and told again.
class HomingHost {
 public:
  explicit HomingHost(const HostValues& host) : settle_(ms(setting(host, "settle_ms", 40))) {}

  void step(SimTime now, Heard heard, Frames& out) {
    for (const TimedFrame& reply : heard) {
      if (is_reply(reply.frame)) hear(now, reply.frame, out);
    }
    if (phase_ == Phase::kSettle && now >= settled_at_) {
      phase_ = Phase::kWork;
      tripped_ = false;  // the bug, second half: errors of homing are of no interest any more
      out.push_back(say_move(kPosition, 60, 200));
    }
    if (now < next_) return;
    next_ += 4ms;
    if (phase_ == Phase::kSeek) {
      out.push_back(say_speed(-100));
      out.push_back(say(kReadAngle));
    }
    out.push_back(say(kReadState1));
  }

 private:
  enum class Phase { kSeek, kSettle, kWork };

  void hear(SimTime now, const protocol::Frame& frame, Frames& out) {
    if (frame.data[0] == kReadAngle && phase_ == Phase::kSeek && angle_deg(frame) < -40) {
      phase_ = Phase::kSettle;
      settled_at_ = now + settle_;
      out.push_back(say_speed(0));
    }
    if (frame.data[0] != kReadState1) return;
    if (frame.data[7] != 0) {
      tripped_ = true;
      out.push_back(say(kClearErrors));
      return;
    }
    // The bug, first half: not while the joint settles, as a drive that starts then would move it.
    if (!tripped_ || phase_ == Phase::kSettle) return;
    tripped_ = false;
    out.push_back(say(kRun));
    if (phase_ == Phase::kWork) out.push_back(say_move(kPosition, 60, 200));
  }

  SimTime settle_;
  SimTime settled_at_{0};
  SimTime next_{0};
  Phase phase_ = Phase::kSeek;
  bool tripped_ = false;
};

/// Starts a move and, where the joint does not break away within a time, helps it with a push.
class BreakAwayHost {
 public:
  explicit BreakAwayHost(const HostValues& host)
      : patience_(ms(setting(host, "patience_ms", 80))) {}

  void step(SimTime now, Heard heard, Frames& out) {
    for (const TimedFrame& reply : heard) {
      // The bug: that a reply came since the move began says nothing about when it was made.
      if (is_reply(reply.frame) && reply.frame.data[0] == kReadState2 && moving_) {
        if (std::abs(speed_dps(reply.frame)) > 10) broke_away_ = true;
        ++replies_;
      }
    }
    if (!moving_ && now >= kStart) {
      moving_ = true;
      out.push_back(say_move(kPosition, 60, 150));
    }
    if (moving_ && !broke_away_ && now >= kStart + patience_ && replies_ * 4ms > patience_ / 2) {
      broke_away_ = true;
      out.push_back(say_move(kTurn, 30, 150));
    }
    if (now < next_) return;
    next_ += 4ms;
    out.push_back(say(kReadState2));
  }

 private:
  static constexpr SimTime kStart = 600ms;
  SimTime patience_;
  SimTime next_{0};
  int replies_ = 0;
  bool moving_ = false;
  bool broke_away_ = false;
};

/// Makes two turns, its command repeated all the time. A drive that has started anew has lost its
/// turns: the host counts them from what it saw last.
class TurnsHost {
 public:
  explicit TurnsHost(const HostValues& host) : speed_dps_(setting(host, "speed_dps", 600)) {}

  void step(SimTime now, Heard heard, Frames& out) {
    for (const TimedFrame& reply : heard) {
      if (!is_reply(reply.frame)) continue;
      if (reply.frame.data[0] == kReadAngle) hear_angle(angle_deg(reply.frame));
      if (reply.frame.data[0] == kReadState1 && reply.frame.data[7] != 0) {
        out.push_back(say(kClearErrors));
        tripped_ = true;
      } else if (reply.frame.data[0] == kReadState1 && tripped_) {
        tripped_ = false;
        out.push_back(say(kRun));
      }
    }
    if (now < next_) return;
    next_ += 5ms;
    if (now >= 100ms) command(out);
    out.push_back(say(kReadAngle));
    out.push_back(say(kReadState1));
  }

 private:
  void hear_angle(double raw_deg) {
    const bool jumped = std::abs(raw_deg + base_deg_ - angle_deg_) > 90;
    // Half a turn to either side is where a drive starts from.
    if (jumped && std::abs(raw_deg) <= 180) {
      // The bug: right for a joint that stood still, or came no further than half a turn.
      base_deg_ = 360 * std::round((angle_deg_ - raw_deg) / 360);
    }
    angle_deg_ = raw_deg + base_deg_;
  }
  void command(Frames& out) const {
    out.push_back(say_move(kPosition, 720 - base_deg_, speed_dps_));
  }

  double speed_dps_;
  double base_deg_ = 0;
  double angle_deg_ = 0;
  SimTime next_{0};
  bool tripped_ = false;
};

}  // namespace

std::vector<Bug> bugs_without_gradient() {
  return {
      {.name = "docking_not_repeated",
       .about = "the reply to the one command of a mode change is lost: what is repeated is the "
                "mode before",
       .has_gradient = false,
       .scenario = R"(
robot = "robots/axis.toml"
duration_s = 1.4
[[expect]]
says = "the joint has docked"
id = 1
signal = "true_angle_deg"
min = 175
max = 185
from_s = 1.25
)",
       .dimensions =
           {
               {.name = "fault.kind",
                .words = {"drop", "delay", "slow_replies", "duplicate", "stale", "reorder",
                          "corrupt"}},
               {.name = "fault.at_s", .from = 0.1, .to = 1.1},
               {.name = "fault.for_s", .from = 0.001, .to = 0.025},
               {.name = "fault.probability", .from = 0.2, .to = 1},
               {.name = "fault.delay.delay_ms", .from = 0, .to = 4},
               {.name = "fault.slow_replies.delay_ms", .from = 0.1, .to = 4},
               {.name = "host.dock_ms", .from = 500, .to = 800},
           },
       .run = run_with<DockingHost>},
      {.name = "error_forgotten_in_homing",
       .about = "a trip is cleared while the joint settles at home, and nobody switches the drive "
                "on again",
       .has_gradient = false,
       .scenario = R"(
robot = "robots/axis.toml"
duration_s = 1.5
[[expect]]
says = "the joint is where it works"
id = 1
signal = "true_angle_deg"
min = 55
max = 65
from_s = 1.45
)",
       .dimensions =
           {
               {.name = "fault.kind",
                .words = {"sag", "voltage_off", "voltage_stuck", "drop", "silent"}},
               {.name = "fault.at_s", .from = 0.05, .to = 1.1},
               {.name = "fault.for_s", .from = 0.005, .to = 0.1},
               {.name = "fault.sag.to_V", .from = 8, .to = 22},
               {.name = "fault.voltage_off.offset_V", .from = -16, .to = 16},
               {.name = "fault.voltage_stuck.value_V", .from = 8, .to = 28},
               {.name = "host.settle_ms", .from = 20, .to = 60},
           },
       .run = run_with<HomingHost>},
      {.name = "stale_standstill",
       .about = "an old reply is taken for a fresh one when a move begins: the joint seems stuck "
                "and gets a push",
       .has_gradient = false,
       .scenario = R"(
robot = "robots/axis.toml"
duration_s = 1.4
[[expect]]
says = "the move ends where it should"
id = 1
signal = "true_angle_deg"
min = 55
max = 65
from_s = 1.3
)",
       .dimensions =
           {
               {.name = "fault.kind",
                .words = {"stale", "drop", "duplicate", "reorder", "torn_reply", "delay"}},
               {.name = "fault.at_s", .from = 0.1, .to = 1.2},
               {.name = "fault.for_s", .from = 0.005, .to = 0.2},
               {.name = "fault.probability", .numbers = {0.25, 1}},
               {.name = "fault.delay.delay_ms", .from = 0, .to = 30},
               {.name = "load.J_g_cm2", .from = 0, .to = 4000},
               {.name = "host.patience_ms", .from = 40, .to = 120},
           },
       .run = run_with<BreakAwayHost>},
      {.name = "turns_lost_on_the_move",
       .about = "after a brown-out the turns are counted from the angle before it, and the joint "
                "has coasted on",
       .has_gradient = false,
       .scenario = R"(
robot = "robots/axis.toml"
duration_s = 2.4
[[expect]]
says = "the target of two turns is reached"
id = 1
signal = "true_angle_deg"
min = 700
max = 740
from_s = 2.35
)",
       .dimensions =
           {
               {.name = "fault.kind",
                .words = {"dip", "sag", "drop", "reset", "delay", "duplicate", "silent"}},
               {.name = "fault.at_s", .from = 0.05, .to = 1.6},
               {.name = "fault.for_s", .from = 0.02, .to = 0.35},
               {.name = "fault.sag.to_V", .from = 4, .to = 22},
               {.name = "fault.delay.delay_ms", .from = 0, .to = 15},
               {.name = "load.J_g_cm2", .from = 0, .to = 2500},
               {.name = "host.speed_dps", .from = 500, .to = 1150},
           },
       .run = run_with<TurnsHost>},
  };
}

}  // namespace lk::emulator::planted
