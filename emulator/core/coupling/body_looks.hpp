#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/body_state.hpp"

namespace lk::emulator {

/// @file What a body looks like, for whoever draws it. Metres, kilograms, newtons; z is up;
/// quaternions are w x y z.

struct BodyPart {
  std::string name;   // empty: it has none
  bool free = false;  // it goes where it likes, as the trunk of a walking robot does
  double mass_kg = 0;
  Triple centre_m{};  // of mass, in the part's own frame
};

enum class GeomKind : std::uint8_t { kPlane, kSphere, kCapsule, kEllipsoid, kCylinder, kBox };

struct BodyGeom {
  std::optional<std::size_t> body;  // of BodyShape::bodies; nothing: it stands in the world
  GeomKind kind = GeomKind::kSphere;
  // Sphere: radius. Capsule, cylinder: radius, half of the length (of a capsule without its ends),
  // along z. Ellipsoid: radii. Box: halves. Plane, normal to z: halves of its sides, 0 for one
  // without end.
  Triple size_m{};
  Triple position_m{};  // in the body's frame, or the world's
  Quaternion quaternion{1, 0, 0, 0};
  std::array<double, 4> colour{};  // red, green, blue, opacity: 0 to 1
};

/// In the frame of its body, which is the one that it moves.
struct BodyJoint {
  std::size_t body = 0;
  Triple axis{};  // of unit length
  Triple anchor_m{};
};

struct BodyShape {
  double mass_kg = 0;  // of all that moves
  std::vector<BodyPart> bodies;
  std::vector<BodyGeom> geoms;
  std::vector<BodyJoint> joints;  // as Mechanism::joints() has them
};

/// Of a body's frame, in the world.
struct BodyPose {
  Triple position_m{};
  Quaternion quaternion{1, 0, 0, 0};
};

struct BodyContact {
  Triple point_m{};
  Triple force_N{};  // on the one of the two that moves; on the second if both do
};

/// What a Mechanism is as well when it can be drawn.
class BodyLooks {
 public:
  virtual ~BodyLooks() = default;
  virtual BodyShape shape() const = 0;
  /// How often shape() has changed: what stands in the world, and nothing else.
  virtual unsigned shape_changes() const { return 0; }
  /// Of shape().bodies, and where they touch something, at the present instant.
  virtual std::vector<BodyPose> poses() const = 0;
  virtual std::vector<BodyContact> contacts() const = 0;

 protected:
  BodyLooks() = default;
  BodyLooks(const BodyLooks&) = default;
  BodyLooks(BodyLooks&&) = default;
  BodyLooks& operator=(const BodyLooks&) = default;
  BodyLooks& operator=(BodyLooks&&) = default;
};

}  // namespace lk::emulator
