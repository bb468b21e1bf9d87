#include "emulator/core/coupling/coupling.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "emulator/core/overloaded.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {
namespace {

/// Step length with a battery and no body. Assumed to suffice: temperatures of motors change more
/// slowly; voltages of DC links change about as fast.
constexpr SimTime kBatteryStep = std::chrono::milliseconds(1);

/// Minimum inertia that a body adds to a shaft, kg·m²; excludes results ≤ 0 by rounding.
constexpr double kLightest = 1e-12;

double seconds(SimTime time) { return static_cast<double>(time.count()) * 1e-9; }

/// Pre: some bus has a body.
const Mechanism& body_of(std::span<const BusConfig> robot) {
  return *std::ranges::find_if(robot, [](const BusConfig& bus) {
            return bus.body != nullptr;
          })->body;
}

/// Returns true if a drive of the robot turns a joint.
bool moves_body(std::span<const BusConfig> robot) {
  return std::ranges::any_of(robot, [](const BusConfig& bus) {
    return bus.body != nullptr && std::ranges::any_of(bus.servos, [](const auto& servo) {
             return servo.joint.has_value();
           });
  });
}

}  // namespace

/// The oscillation is too fast if its phase advances more than half a radian per step (assumed).
bool is_stiff(const model::MechanicsParams& m, double J_body, SimTime step) {
  const double J_rotor = m.J * m.gear_ratio * m.gear_ratio;
  const double omega2 = m.gear_stiffness_out * (1.0 / (m.J_out + J_body) + 1.0 / J_rotor);
  return omega2 * seconds(step) * seconds(step) > 0.25;
}

bool Coupling::needed(std::span<const BusConfig> robot) {
  return moves_body(robot) || Battery::needed(robot);
}

Coupling::Coupling(std::span<const BusConfig> robot, std::span<Bus* const> buses)
    : mechanism_(moves_body(robot) ? body_of(robot).clone() : nullptr),
      torques_(mechanism_ ? mechanism_->joints().size() : 0),
      step_(mechanism_ ? mechanism_->step() : kBatteryStep) {
  if (Battery::needed(robot)) battery_.emplace(robot, buses);
  for (std::size_t n = 0; n < robot.size(); ++n) {
    for (const ServoConfig& servo : robot[n].servos) {
      if (!servo.joint) continue;
      const double rate = servo.joint->rate;
      const double J = mechanism_->joint(servo.joint->joint).inertia_kg_m2 / (rate * rate);
      links_.push_back({n, servo.id, *servo.joint});
      links_.back().stiff = is_stiff(servo.profile.drive.mechanics, J, step_);
    }
  }
  begin(buses);
}

Coupling::Coupling(std::unique_ptr<Mechanism> mechanism, std::span<const CoupledDrive> drives,
                   SimTime start)
    : mechanism_(std::move(mechanism)),
      torques_(mechanism_->joints().size()),
      end_(start),
      step_(mechanism_->step()) {
  for (const CoupledDrive& drive : drives) {
    links_.push_back({drive.bus, drive.id, drive.joint, drive.stiff});
  }
}

Coupling::Coupling(const Coupling& other)
    : mechanism_(other.mechanism_ ? other.mechanism_->clone() : nullptr),
      battery_(other.battery_),
      links_(other.links_),
      torques_(other.torques_),
      pushing_(other.pushing_),
      state_(other.state_),
      end_(other.end_),
      under_way_(other.under_way_),
      step_(other.step_),
      failure_(other.failure_) {}

Coupling& Coupling::operator=(const Coupling& other) { return *this = Coupling(other); }

bool Coupling::take_acts(std::span<Bus* const> buses) {
  std::vector<BodyAct> acts;
  bool posed = false;
  for (Bus* const bus : buses) bus->take_body_acts(acts);
  for (const BodyAct& act : acts) {
    std::visit(
        overloaded{
            [&](const Push& push) {
              pushing_.push_back({push, end_ + push.duration});
            },
            [&](const CarriedMass& payload) { mechanism_->carry(payload.part, payload.mass_kg); },
            [&](const Freeze& freeze) { mechanism_->freeze(freeze.on); },
            [&](const Floor& floor) { mechanism_->set_floor(floor); },
            [&](const Pose& pose) {
              mechanism_->pose(pose);
              posed = true;
            },
        },
        act.what);
  }
  return posed;
}

/// Applies the sum of all pushes on each part. A push lasts whole steps.
void Coupling::apply_pushes() {
  for (const Pushing& one : pushing_) {
    Push sum{.part = one.push.part};
    for (const Pushing& other : pushing_) {
      if (other.push.part != sum.part || other.until <= end_) continue;
      for (std::size_t n = 0; n < 3; ++n) {
        sum.force_N[n] += other.push.force_N[n];
        sum.torque_Nm[n] += other.push.torque_Nm[n];
      }
    }
    mechanism_->push(sum.part, sum.force_N, sum.torque_Nm);
  }
  std::erase_if(pushing_, [this](const Pushing& one) { return one.until <= end_; });
}

void Coupling::begin(std::span<Bus* const> buses) {
  under_way_ = true;
  if (mechanism_ && !failure_) mount(buses);
  end_ += step_;
}

/// Within a step the motors see their joints as independent: the torque of a drive affects other
/// joints only from the next step on.
void Coupling::mount(std::span<Bus* const> buses) {
  const bool posed = take_acts(buses);
  apply_pushes();
  for (Link& link : links_) {
    link.armature = buses[link.bus]->state().mounted_shaft(link.id).armature;
    mechanism_->set_armature(link.joint.joint, link.armature * link.joint.rate * link.joint.rate);
  }
  mechanism_->update();
  if (has_failed()) return;
  for (Link& link : links_) {
    const JointView joint = mechanism_->joint(link.joint.joint);
    const double rate = link.joint.rate;
    link.mount = {.theta = link.joint.output_of(joint.angle_rad),
                  .omega = rate * joint.speed_rad_s,
                  .J = std::max(joint.inertia_kg_m2 / (rate * rate) - link.armature, kLightest),
                  .tau = joint.body_torque_Nm / rate,
                  .stiff = link.stiff,
                  .posed = posed};
    buses[link.bus]->state().mount(link.id, link.mount,
                                   {joint.angle_rad, joint.speed_rad_s, link.torque_Nm});
  }
  mechanism_->read_state(state_);
  for (Bus* const bus : buses) bus->state().body = state_;
}

/// Pre: a step begins or ends now, so `end_` is the present time. Stores the failure of the body.
bool Coupling::has_failed() {
  const auto reason = mechanism_->failure();
  if (reason) failure_ = "the body at " + time_text(end_) + ": " + *reason;
  return reason.has_value();
}

/// Returns the torque of a drive on its joint, from the motion of the shaft in the step. The change
/// of speed gives the mean, the distance gives the slope. Uses the armature that the body included
/// in this step, even if the coupling has broken since.
JointTorque Coupling::drive_torque(const Link& link, const model::MountedShaft& shaft) const {
  const double step_s = seconds(step_);
  const double J = link.mount.J + link.armature;
  const double gained = shaft.omega - link.mount.omega;
  const double ahead = shaft.theta - link.mount.theta - step_s * (link.mount.omega + 0.5 * gained);
  const double mean = J * gained / step_s - link.mount.tau;
  const double slope = -12.0 * J * ahead / (step_s * step_s * step_s);
  return {mean * link.joint.rate, slope * link.joint.rate,
          shaft.theta / link.joint.rate + link.joint.offset_rad, shaft.omega / link.joint.rate};
}

void Coupling::exchange(std::span<Bus* const> buses) {
  finish(buses);
  begin(buses);
}

void Coupling::finish(std::span<Bus* const> buses) {
  under_way_ = false;
  if (battery_) battery_->exchange(buses, step_);
  if (!mechanism_ || failure_) return;
  for (Link& link : links_) {
    const model::MountedShaft shaft = buses[link.bus]->state().mounted_shaft(link.id);
    torques_[link.joint.joint] = drive_torque(link, shaft);
    const double own = link.armature * (shaft.omega - link.mount.omega) / seconds(step_);
    link.torque_Nm = torques_[link.joint.joint].mean_Nm - own * link.joint.rate;
  }
  mechanism_->advance(torques_);
  has_failed();
}

}  // namespace lk::emulator
