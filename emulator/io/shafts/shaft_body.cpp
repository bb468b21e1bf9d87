#include "emulator/io/shafts/shaft_body.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "emulator/config/ip_address.hpp"
#include "emulator/core/coupling/coupling.hpp"
#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kExamples = "unix:/tmp/shafts or tcp:29600";

}  // namespace

std::variant<ShaftOptions, std::string> parse_shafts_place(const std::string& text) {
  ShaftOptions place;
  if (text.starts_with("unix:")) {
    place.path = text.substr(5);
    if (place.path.empty()) return "unix: needs a path, like unix:/tmp/shafts";
    return place;
  }
  if (!text.starts_with("tcp:")) {
    return "\"" + text + "\" is not unix:PATH or tcp:[ADDR:]PORT, like " + kExamples;
  }
  const std::string rest = text.substr(4);
  const std::size_t colon = rest.rfind(':');
  place.address = kLoopback;
  if (colon != std::string::npos) {
    const std::string host = rest.substr(0, colon);
    const auto address = address_in(host);
    if (!address) return "\"" + host + "\" is not an IP address or localhost";
    place.address = *address;
  }
  const auto port =
      number_of(colon == std::string::npos ? rest : rest.substr(colon + 1), 10, UINT16_MAX);
  if (!port) return "\"" + text + "\" needs a port from 0 to 65535, like tcp:29600";
  place.port = static_cast<std::uint16_t>(*port);
  return place;
}

std::optional<ShaftsLost> parse_shafts_lost(const std::string& text) {
  if (text == "free") return ShaftsLost::kFree;
  if (text == "stop") return ShaftsLost::kStop;
  return std::nullopt;
}

namespace {

constexpr std::size_t kLongestReason = 1000;

ShaftBytes message(std::uint32_t kind, std::uint32_t joints, std::uint32_t what,
                   std::uint64_t number) {
  ShaftBytes bytes(lk_shafts_bytes(kind, joints));
  const lk_shafts_head head{kind, static_cast<std::uint32_t>(bytes.size()), joints, what, number};
  lk_shafts_put_head(bytes.data(), &head);
  return bytes;
}

}  // namespace

ShaftBytes offer_message(std::span<const lk_shafts_offer> offers, std::uint64_t step_ns) {
  const auto joints = static_cast<std::uint32_t>(offers.size());
  ShaftBytes bytes = message(LK_SHAFTS_OFFER, joints, 0, step_ns);
  for (std::uint32_t n = 0; n < joints; ++n) {
    lk_shafts_put_offer(&bytes[lk_shafts_at(LK_SHAFTS_OFFER, n)], &offers[n]);
  }
  return bytes;
}

ShaftBytes torques_message(std::span<const lk_shafts_torque> torques, std::uint32_t steps,
                           std::uint64_t number) {
  const auto joints = static_cast<std::uint32_t>(torques.size());
  ShaftBytes bytes = message(LK_SHAFTS_TORQUES, joints, steps, number);
  for (std::uint32_t n = 0; n < joints; ++n) {
    lk_shafts_put_torque(&bytes[lk_shafts_at(LK_SHAFTS_TORQUES, n)], &torques[n]);
  }
  return bytes;
}

ShaftBytes end_message(std::string_view why) {
  why = why.substr(0, kLongestReason);
  const std::size_t padded = (why.size() + 7) / 8 * 8;
  ShaftBytes bytes(LK_SHAFTS_HEAD_BYTES + padded);
  const lk_shafts_head head{LK_SHAFTS_END, static_cast<std::uint32_t>(bytes.size()), 0,
                            static_cast<std::uint32_t>(why.size()), 0};
  lk_shafts_put_head(bytes.data(), &head);
  std::ranges::copy(why, bytes.begin() + LK_SHAFTS_HEAD_BYTES);
  return bytes;
}

std::size_t ShaftReader::bytes_missing() const {
  const std::size_t whole =
      bytes_.size() < LK_SHAFTS_HEAD_BYTES ? LK_SHAFTS_HEAD_BYTES : head_.bytes;
  return whole - bytes_.size();
}

ShaftReader::Message ShaftReader::take(std::span<const unsigned char> bytes) {
  assert(bytes.size() <= bytes_missing());
  if (!wrong_.empty()) return wrong_;
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  if (bytes_.size() < LK_SHAFTS_HEAD_BYTES) return More{};
  if (bytes_.size() == LK_SHAFTS_HEAD_BYTES) {
    const char* const wrong = lk_shafts_get_head(bytes_.data(), &head_);
    if (wrong != nullptr) {
      wrong_ = std::string("sent a message that ") + wrong;
    } else if (head_.kind != LK_SHAFTS_ACCEPT && head_.kind != LK_SHAFTS_STATES) {
      wrong_ = "sent a message of a kind that only lk-emu sends";
    } else if (head_.joints != joints_) {
      wrong_ = "sent a message of " + std::to_string(head_.joints) + " joints where there are " +
               std::to_string(joints_);
    }
    if (!wrong_.empty()) return wrong_;
  }
  if (bytes_.size() < head_.bytes) return More{};
  const ShaftBytes whole = std::exchange(bytes_, {});
  if (head_.kind == LK_SHAFTS_ACCEPT) {
    ShaftAccept accept{head_, std::vector<lk_shafts_accept>(joints_)};
    for (std::uint32_t n = 0; n < joints_; ++n) {
      lk_shafts_get_accept(&whole[lk_shafts_at(LK_SHAFTS_ACCEPT, n)], &accept.records[n]);
    }
    return accept;
  }
  ShaftStates states{head_, std::vector<lk_shafts_state>(joints_)};
  for (std::uint32_t n = 0; n < joints_; ++n) {
    lk_shafts_get_state(&whole[lk_shafts_at(LK_SHAFTS_STATES, n)], &states.records[n]);
  }
  return states;
}

namespace {

// More than any joint reaches, and far below the numeric limits of the model.
constexpr double kMaxAngle_rad = 1e5;
constexpr double kMaxSpeed_rad_s = 1e4;
constexpr double kMaxInertia_kg_m2 = 1e6;
constexpr double kMaxTorque_Nm = 1e6;
/// Minimum armature for a joint of unknown inertia, as lk-emu then computes with the armature.
constexpr double kLeastArmature_kg_m2 = 1e-9;
/// Relative rounding error by which a received inertia may be below the armature.
constexpr double kRounding = 1e-6;

bool within(double value, double most) { return std::abs(value) <= most; }  // false for NaN

bool is_unknown(const lk_shafts_accept& terms, const lk_shafts_state& state) {
  return terms.owner == LK_SHAFTS_SIMULATOR &&
         (state.inertia_kg_m2 == 0 || (terms.flags & LK_SHAFTS_TORQUE_UNTOLD) != 0);
}

/// Returns the first number out of range, or ""; ignores numbers that lk-emu does not use.
std::string problem_of_numbers(const lk_shafts_state& state, const lk_shafts_accept& terms) {
  const bool moved_by_simulator = terms.owner == LK_SHAFTS_SIMULATOR;
  const auto is = [](const char* what, double value) {
    return fmt::format("{} is {}", what, value);
  };
  if (moved_by_simulator && !within(state.angle_rad, kMaxAngle_rad)) {
    return is("angle_rad", state.angle_rad);
  }
  if (moved_by_simulator && !within(state.speed_rad_s, kMaxSpeed_rad_s)) {
    return is("speed_rad_s", state.speed_rad_s);
  }
  if (!within(state.inertia_kg_m2, kMaxInertia_kg_m2) || state.inertia_kg_m2 < 0) {
    return is("inertia_kg_m2", state.inertia_kg_m2);
  }
  if (!is_unknown(terms, state) && !within(state.torque_Nm, kMaxTorque_Nm)) {
    return is("torque_Nm", state.torque_Nm);
  }
  return "";
}

}  // namespace

bool is_one_shaft(const model::MechanicsParams& gear, SimTime step) {
  return is_stiff(gear, 0.0, step);
}

ShaftBody::ShaftBody(std::vector<ShaftJoint> joints, SimTime step) : step_(step) {
  for (ShaftJoint& joint : joints) {
    names_.push_back(std::move(joint.name));
    joints_.push_back({.terms = joint.terms,
                       .state = {joint.angle_rad, joint.speed_rad_s, 0, 0},
                       .armature_kg_m2 = joint.armature_kg_m2,
                       .received_armature_kg_m2 = joint.armature_kg_m2});
  }
}

/// Returns the armature for an unknown inertia: a value below the true one is always stable
/// (docs/guides/your-simulator.md).
double ShaftBody::inertia_of(const Joint& joint) {
  const double inertia_kg_m2 = joint.state.inertia_kg_m2;
  if (joint.terms.owner == LK_SHAFTS_DRIVE) return inertia_kg_m2 + joint.armature_kg_m2;
  if (inertia_kg_m2 == 0) return joint.armature_kg_m2;
  return inertia_kg_m2 + joint.armature_kg_m2 - joint.received_armature_kg_m2;
}

JointView ShaftBody::joint(std::size_t joint) const {
  const Joint& it = joints_[joint];
  return {it.state.angle_rad, it.state.speed_rad_s, inertia_of(it), it.state.torque_Nm};
}

void ShaftBody::set_armature(std::size_t joint, double inertia_kg_m2) {
  joints_[joint].armature_kg_m2 = inertia_kg_m2;
}

void ShaftBody::advance(std::span<const JointTorque> torques) {
  ++steps_;
  for (std::size_t n = 0; n < joints_.size(); ++n) {
    Joint& joint = joints_[n];
    joint.torque_Nm += torques[n].mean_Nm;
    joint.slope_Nm_s = torques[n].slope_Nm_s;
    joint.state.angle_rad = torques[n].angle_rad;
    joint.state.speed_rad_s = torques[n].speed_rad_s;
  }
}

std::optional<std::string> ShaftBody::problem_of(std::span<const lk_shafts_state> states) const {
  for (std::size_t n = 0; n < joints_.size(); ++n) {
    const Joint& joint = joints_[n];
    const bool moved_by_simulator = joint.terms.owner == LK_SHAFTS_SIMULATOR;
    const double inertia = states[n].inertia_kg_m2;
    const double armature = joint.armature_kg_m2;
    std::string problem = problem_of_numbers(states[n], joint.terms);
    if (problem.empty() && moved_by_simulator && inertia == 0 && armature < kLeastArmature_kg_m2) {
      problem = "inertia_kg_m2 is 0; must be above 0, as the drive has no armature";
    }
    if (problem.empty() && moved_by_simulator && inertia > 0 &&
        inertia < armature * (1 - kRounding)) {
      problem =
          fmt::format("inertia_kg_m2 is {}, below the drive's armature of {}", inertia, armature);
    }
    if (!problem.empty()) return names_[n] + ": " + problem;
  }
  return std::nullopt;
}

double ShaftBody::estimated_torque(const Joint& joint, double speed_rad_s) const {
  if (!joint.received_speed_rad_s || steps_ == 0) return 0;
  const double steps = steps_;
  const double elapsed_s = steps * static_cast<double>(step_.count()) * 1e-9;
  const double acceleration = (speed_rad_s - *joint.received_speed_rad_s) / elapsed_s;
  return inertia_of(joint) * acceleration - joint.torque_Nm / steps;
}

void ShaftBody::take(std::span<const lk_shafts_state> states) {
  for (std::size_t n = 0; n < joints_.size(); ++n) {
    Joint& joint = joints_[n];
    const lk_shafts_state& received = states[n];
    joint.received_armature_kg_m2 = joint.armature_kg_m2;
    joint.state.inertia_kg_m2 = received.inertia_kg_m2;
    joint.state.torque_Nm = received.torque_Nm;
    if (joint.terms.owner == LK_SHAFTS_SIMULATOR) {
      if (is_unknown(joint.terms, received))
        joint.state.torque_Nm = estimated_torque(joint, received.speed_rad_s);
      joint.state.angle_rad = received.angle_rad;
      joint.state.speed_rad_s = received.speed_rad_s;
      joint.received_speed_rad_s = received.speed_rad_s;
    }
    joint.torque_Nm = 0;
  }
  steps_ = 0;
}

std::vector<lk_shafts_torque> ShaftBody::torques() const {
  std::vector<lk_shafts_torque> all;
  for (const Joint& joint : joints_) {
    all.push_back({joint.torque_Nm / steps_, joint.slope_Nm_s, joint.armature_kg_m2,
                   joint.state.angle_rad, joint.state.speed_rad_s});
  }
  return all;
}

}  // namespace lk::emulator
