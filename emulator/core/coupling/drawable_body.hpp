#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/body_state.hpp"

namespace lk::emulator {

/// @file Shape and poses of a body, for drawing. Metres, kilograms, newtons; z is up; quaternions
/// are w x y z.

struct BodyPart {
  std::string name;   // empty: unnamed
  bool free = false;  // has a free joint, as the trunk of a walking robot
  double mass_kg = 0;
  Triple centre_m{};  // centre of mass, in the part's own frame
};

enum class GeomKind : std::uint8_t {
  kPlane,
  kSphere,
  kCapsule,
  kEllipsoid,
  kCylinder,
  kBox,
  kMesh
};

struct BodyGeom {
  std::optional<std::size_t> body;  // index in BodyShape::bodies; nullopt: fixed to the world
  GeomKind kind = GeomKind::kSphere;
  // Sphere: radius. Capsule, cylinder: radius, half length along z (capsule: without its ends).
  // Ellipsoid: radii. Box, mesh: half sides. Plane, normal to z: half sides, 0 if infinite.
  Triple size_m{};
  std::size_t mesh = 0;  // of a mesh: index in BodyShape::meshes
  Triple position_m{};   // in the body's frame, or the world's
  Quaternion quaternion{1, 0, 0, 0};
  std::array<double, 4> colour{};  // red, green, blue, opacity: 0 to 1
};

/// Triangles, in the frame of the geom.
struct BodyMesh {
  std::vector<float> vertices_m;  // x y z of each
  std::vector<int> faces;         // three vertices of each
};

/// A joint, in the frame of the body that the joint moves.
struct BodyJoint {
  std::size_t body = 0;
  Triple axis{};  // of unit length
  Triple anchor_m{};
};

struct BodyShape {
  double mass_kg = 0;  // sum over all moving parts
  std::vector<BodyPart> bodies;
  std::vector<BodyGeom> geoms;
  std::vector<BodyMesh> meshes;   // empty: no geom shows it
  std::vector<BodyJoint> joints;  // in the order of Mechanism::joints()
};

/// Pose of a body's frame in the world.
struct BodyPose {
  Triple position_m{};
  Quaternion quaternion{1, 0, 0, 0};
};

struct BodyContact {
  Triple point_m{};
  Triple force_N{};  // force on the part that moves; if both parts move, on the second
};

/// Second interface of a Mechanism that can be drawn.
class DrawableBody {
 public:
  virtual ~DrawableBody() = default;
  virtual BodyShape shape() const = 0;
  /// Number of changes of shape() so far. Only geoms of the world change.
  virtual unsigned shape_changes() const { return 0; }
  /// Poses of shape().bodies, and contacts, at the present instant.
  virtual std::vector<BodyPose> poses() const = 0;
  virtual std::vector<BodyContact> contacts() const = 0;

 protected:
  DrawableBody() = default;
  DrawableBody(const DrawableBody&) = default;
  DrawableBody(DrawableBody&&) = default;
  DrawableBody& operator=(const DrawableBody&) = default;
  DrawableBody& operator=(DrawableBody&&) = default;
};

}  // namespace lk::emulator
