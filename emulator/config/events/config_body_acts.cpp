#include "emulator/config/events/config_body_acts.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "emulator/core/units.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {
namespace {

constexpr double kStrongest = 1e6;       // limit of a force in N and a torque in Nm; assumed
constexpr double kHeaviest_kg = 1e4;     // assumed
constexpr double kLeastFriction = 1e-5;  // MuJoCo's minimum
constexpr double kMaxFriction = 10;      // assumed
constexpr double kSteepest_deg = 60;     // assumed: steeper than a walking robot climbs
constexpr double kHighestStep_m = 10;    // assumed
constexpr double kFarthest_m = 1e3;      // assumed
constexpr double kMaxTurned_deg = 3600;  // of joints without stops; assumed

std::vector<std::string> named(std::span<const std::string> all) {
  std::vector<std::string> names;
  std::ranges::copy_if(all, std::back_inserter(names),
                       [](const auto& one) { return !one.empty(); });
  return names;
}

/// Returns the index in `all` of the name at `key`.
std::optional<std::size_t> read_named(TableReader& table, const char* key,
                                      std::span<const std::string> all) {
  const std::vector<std::string> names = named(all);
  const auto place = table.choice(key, names);
  if (!place) return std::nullopt;
  return static_cast<std::size_t>(std::ranges::find(all, names[*place]) - all.begin());
}

std::size_t read_part(TableReader& table, const Mechanism& body) {
  return table.required("body", read_named(table, "body", body.parts()));
}

std::size_t read_free_part(TableReader& table, const Mechanism& body, const char* what) {
  const auto places = body.free_parts();
  if (places.empty()) table.fail(what, "the model has no free body");
  std::vector<std::string> names;
  for (const std::size_t place : places) names.push_back(body.parts()[place]);
  if (const auto place = table.choice("body", names)) return places[*place];
  if (places.size() > 1) table.fail(what, "needs body, one of " + comma_list(names));
  return places.front();
}

std::string degrees_text(double angle_rad) { return plain_number(angle_rad / kRadPerDeg, 6); }

void read_joints(TableReader joints, const Mechanism& body, Pose& pose) {
  for (std::size_t n = 0; n < body.joints().size(); ++n) {
    const std::string& name = body.joints()[n];
    const auto angle_deg = joints.number(name, -kMaxTurned_deg, kMaxTurned_deg);
    if (!angle_deg) continue;
    const double angle_rad = *angle_deg * kRadPerDeg;
    const auto stops = body.stops(n);
    if (stops && (angle_rad < stops->front() - 1e-9 || angle_rad > stops->back() + 1e-9)) {
      joints.fail(name, "is out of range (" + degrees_text(stops->front()) + " to " +
                            degrees_text(stops->back()) + " degrees)");
    }
    pose.joints.push_back({n, angle_rad});
  }
  joints.finish();
}

}  // namespace

BodyAct read_push(TableReader& event, const Mechanism& body) {
  auto table = *event.table("push");
  Push push;
  push.part = read_part(table, body);
  const auto force = table.numbers("force_N", 3, -kStrongest, kStrongest);
  const auto torque = table.numbers("torque_Nm", 3, -kStrongest, kStrongest);
  std::ranges::copy(force, push.force_N.begin());
  std::ranges::copy(torque, push.torque_Nm.begin());
  if (force.empty() && torque.empty()) table.note_missing("force_N");
  const double lasts_s = table.required("for_s", table.number("for_s", 0, 1e6));
  push.duration = SimTime(protocol::rounded(lasts_s * 1e9));
  table.finish();
  return {push};
}

BodyAct read_payload(TableReader& event, const Mechanism& body) {
  auto table = *event.table("payload");
  CarriedMass payload;
  payload.part = read_part(table, body);
  payload.mass_kg = table.required("mass_kg", table.number("mass_kg", 0, kHeaviest_kg));
  table.finish();
  return {payload};
}

BodyAct read_freeze(TableReader& event, const Mechanism& /*body*/) {
  return {Freeze{*event.boolean("freeze")}};
}

BodyAct read_floor(TableReader& event, const Mechanism& body) {
  auto table = *event.table("floor");
  if (!body.has_floor()) {
    event.fail("floor", "the model has no floor: no plane of its worldbody, but walls");
  }
  Floor floor;
  floor.friction = table.number("friction", kLeastFriction, kMaxFriction);
  if (const auto slope_deg = table.number("slope_deg", -kSteepest_deg, kSteepest_deg)) {
    floor.slope_rad = *slope_deg * kRadPerDeg;
  }
  const auto step_m = table.number("step_m", 0, kHighestStep_m);
  const auto step_at_x_m = table.number("step_at_x_m", -kFarthest_m, kFarthest_m);
  if (step_m) floor.step = FloorStep{*step_m, step_at_x_m.value_or(0)};
  if (step_m.value_or(0) > 0 && !step_at_x_m) table.note_missing("step_at_x_m");
  if (step_at_x_m && !step_m) table.note_missing("step_m");
  if (!floor.friction && !floor.slope_rad && !floor.step && !step_at_x_m)
    table.note_missing("friction");
  table.finish();
  return {floor};
}

BodyAct read_pose(TableReader& event, const Mechanism& body) {
  auto table = *event.table("pose");
  Pose pose;
  if (table.has("keyframe") && named(body.keyframes()).empty()) {
    table.fail("keyframe", "the model has no keyframe with a name");
  }
  pose.keyframe = read_named(table, "keyframe", body.keyframes());
  const auto position = table.numbers("position_m", 3, -kFarthest_m, kFarthest_m);
  const auto rpy = table.numbers("rpy_deg", 3, -360, 360);
  if (!position.empty() || !rpy.empty() || table.has("body")) {
    const char* const what = !position.empty() ? "position_m" : !rpy.empty() ? "rpy_deg" : "body";
    pose.part = read_free_part(table, body, what);
  }
  if (!position.empty()) std::ranges::copy(position, pose.position_m.emplace().begin());
  if (!rpy.empty()) {
    std::ranges::transform(rpy, pose.rpy_rad.emplace().begin(),
                           [](double angle_deg) { return angle_deg * kRadPerDeg; });
  }
  if (auto joints = table.table("joints_deg")) read_joints(*joints, body, pose);
  table.finish();
  if (!pose.keyframe && !pose.position_m && !pose.rpy_rad && pose.joints.empty()) {
    table.fail("", "needs one of keyframe, position_m, rpy_deg and joints_deg");
  }
  return {std::move(pose)};
}

}  // namespace lk::emulator
