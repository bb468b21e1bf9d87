// Stream of a body's poses, and JSON of its shape.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>
#include <utility>

#include "emulator/core/servo/signals.hpp"
#include "emulator/core/units.hpp"
#include "emulator/io/control/control_json.hpp"
#include "emulator/io/control/stream_client.hpp"

namespace lk::emulator {
namespace {

/// Words for GeomKind, in its order.
constexpr const char* kGeomWords[] = {"plane",    "sphere", "capsule", "ellipsoid",
                                      "cylinder", "box",    "mesh"};

Json geom_json(const BodyGeom& geom) {
  Json json = {{"body", geom.body ? Json(*geom.body) : Json(nullptr)},
               {"type", kGeomWords[static_cast<std::size_t>(geom.kind)]},
               {"size_m", geom.size_m},
               {"position_m", geom.position_m},
               {"quaternion", geom.quaternion},
               {"colour", geom.colour}};
  if (geom.kind == GeomKind::kMesh) json["mesh"] = geom.mesh;
  return json;
}

/// Rounds to 10 µm, for short numbers.
Json mesh_json(const BodyMesh& mesh) {
  Json vertices = Json::array();
  for (const float value : mesh.vertices_m) {
    vertices.push_back(std::round(static_cast<double>(value) * 1e5) / 1e5);
  }
  return {{"vertices_m", std::move(vertices)}, {"faces", mesh.faces}};
}

Json degrees_json(const std::array<double, 2>& range_rad) {
  return {range_rad.front() / kRadPerDeg, range_rad.back() / kRadPerDeg};
}

/// Returns bus and ID of each joint's drive, by joint; both null for a joint without a drive.
std::vector<Json> drives_of(const World& world, std::size_t joints) {
  std::vector<Json> drives(joints, {{"bus", nullptr}, {"id", nullptr}});
  for (const auto& line : world.lines()) {
    for (const ServoConfig& servo : line->config().servos) {
      if (servo.joint) drives[servo.joint->joint] = {{"bus", line->name()}, {"id", servo.id}};
    }
  }
  return drives;
}

Json numbers(const BodyPose& pose) {
  Json all = pose.position_m;
  for (const double part : pose.quaternion) all.push_back(part);
  return all;
}

/// Appends `values`, rounded to five digits, which are enough to draw a body.
void append(std::string& text, std::span<const double> values, bool first) {
  text += first ? '[' : ',';
  for (std::size_t n = 0; n < values.size(); ++n) {
    const double value = std::isfinite(values[n]) ? values[n] : 0.0;
    fmt::format_to(std::back_inserter(text), "{}{:.5g}", n == 0 ? "" : ",", value);
  }
}

}  // namespace

const DrawableBody* drawable_body(const World& world) {
  return dynamic_cast<const DrawableBody*>(world.body());
}

Json body_json(const World& world) {
  const DrawableBody& body = *drawable_body(world);
  const BodyShape shape = body.shape();
  const auto names = world.body()->joints();
  Json bodies = Json::array();
  for (const BodyPart& part : shape.bodies) {
    bodies.push_back({{"name", part.name},
                      {"free", part.free},
                      {"mass_kg", part.mass_kg},
                      {"centre_m", part.centre_m}});
  }
  Json geoms = Json::array();
  for (const BodyGeom& geom : shape.geoms) geoms.push_back(geom_json(geom));
  Json meshes = Json::array();
  for (const BodyMesh& mesh : shape.meshes) meshes.push_back(mesh_json(mesh));
  std::vector<Json> joints = drives_of(world, names.size());
  for (std::size_t n = 0; n < shape.joints.size(); ++n) {
    joints[n]["name"] = names[n];
    joints[n]["body"] = shape.joints[n].body;
    joints[n]["axis"] = shape.joints[n].axis;
    joints[n]["anchor_m"] = shape.joints[n].anchor_m;
    const auto stops = world.body()->stops(n);
    joints[n]["range_deg"] = stops ? degrees_json(*stops) : Json(nullptr);
  }
  joints.resize(shape.joints.size());
  Json poses = Json::array();
  for (const BodyPose& pose : body.poses()) poses.push_back(numbers(pose));
  Json values = Json::object();
  const Line& line = *world.lines().front();
  if (const BodySignals* const all = line.config().body_signals.get()) {
    for (const Signal& one : all->all()) {
      values[std::string(one.name)] = one.of_body(line.bus().state().body, one.part);
    }
  }
  return {{"mass_kg", shape.mass_kg}, {"signals", values},
          {"bodies", bodies},         {"geoms", geoms},
          {"meshes", meshes},         {"joints", joints},
          {"poses", poses},           {"shape_changes", body.shape_changes()}};
}

namespace {

/// Returns the present time, poses and contacts as JSON text: cheaper than Json, for 60 messages a
/// second.
std::string body_state_text(const World& world) {
  const DrawableBody& body = *drawable_body(world);
  std::string text = fmt::format(R"({{"time_s":{},"shape_changes":{},"poses":[)",
                                 in_seconds(world.time()), body.shape_changes());
  bool first = true;
  for (const BodyPose& pose : body.poses()) {
    text += std::exchange(first, false) ? "" : ",";
    append(text, pose.position_m, true);
    append(text, pose.quaternion, false);
    text += ']';
  }
  text += "],\"joints_deg\":[";
  for (std::size_t n = 0; n < world.body()->joints().size(); ++n) {
    const double angle_deg = world.body()->joint(n).angle_rad / kRadPerDeg;
    fmt::format_to(std::back_inserter(text), "{}{:.1f}", n == 0 ? "" : ",",
                   std::isfinite(angle_deg) ? angle_deg : 0.0);
  }
  text += "],\"contacts\":[";
  first = true;
  for (const BodyContact& contact : body.contacts()) {
    text += std::exchange(first, false) ? "" : ",";
    append(text, contact.point_m, true);
    append(text, contact.force_N, false);
    text += ']';
  }
  return text + "]}";
}

constexpr auto kPeriod = std::chrono::microseconds(16'667);

class BodyStream : public StreamClient {
 public:
  explicit BodyStream(StreamPeer peer)
      : StreamClient(std::move(peer), &HttpShared::body_streams, 1) {}

 private:
  void begin() override {
    due_ = monotonic_now();
    send_pose();
  }

  /// Sends the poses if time has advanced, then schedules the next call one period after the last
  /// due time.
  void send_pose() {
    if (!writing_ && sent_at_ != world().time()) {
      sent_at_ = world().time();
      text_ = body_state_text(world());
      writing_ = true;
      write(text_);
    }
    const MonoTime now = monotonic_now();
    due_ = std::max(due_ + kPeriod, now);
    do_after(due_ - now, [this] { send_pose(); });
  }

  void on_written() override { writing_ = false; }

  std::string text_;  // message being sent
  std::optional<SimTime> sent_at_;
  MonoTime due_{0};
  bool writing_ = false;
};

}  // namespace

void stream_body(StreamPeer peer) { std::make_shared<BodyStream>(std::move(peer))->start(); }

}  // namespace lk::emulator
