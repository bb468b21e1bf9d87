#pragma once

/// @file Messages of the shaft port (lk_shafts.h) as bytes. Received bytes are not trusted.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "emulator/core/coupling/mechanism.hpp"
#include "emulator/io/shafts/lk_shafts.h"

namespace lk::emulator {

/// Behaviour of the drives when their simulator stops, vanishes or sends invalid data.
enum class ShaftsLost : std::uint8_t {
  kFree,  // they keep running: shafts keep their last inertia, without external torque
  kStop,  // time stands still until a simulator connects
};

/// Address for simulators (--shafts).
struct ShaftOptions {
  std::string path = {};     // Unix socket path; empty: TCP
  std::string address = {};  // an IP address
  std::uint16_t port = 0;    // 0: any free port
  ShaftsLost lost = ShaftsLost::kFree;
};

/// Parses "unix:PATH" or "tcp:[ADDR:]PORT"; returns the error otherwise.
std::variant<ShaftOptions, std::string> parse_shafts_place(const std::string& text);
/// Parses "free" or "stop".
std::optional<ShaftsLost> parse_shafts_lost(const std::string& text);

using ShaftBytes = std::vector<unsigned char>;

ShaftBytes offer_message(std::span<const lk_shafts_offer> offers, std::uint64_t step_ns);
ShaftBytes torques_message(std::span<const lk_shafts_torque> torques, std::uint32_t steps,
                           std::uint64_t number);
/// Returns an END message; truncates `why` to 1000 bytes.
ShaftBytes end_message(std::string_view why);

/// Messages of a simulator: the head, and one record per offered joint.
struct ShaftAccept {
  lk_shafts_head head;
  std::vector<lk_shafts_accept> records;
};
struct ShaftStates {
  lk_shafts_head head;
  std::vector<lk_shafts_state> records;
};

/// Splits the bytes of a simulator into messages for this number of joints.
class ShaftReader {
 public:
  explicit ShaftReader(std::uint32_t joints) : joints_(joints) {}

  struct More {};  // the message is incomplete
  using Message = std::variant<More, ShaftAccept, ShaftStates, std::string>;
  /// Bytes missing of the head, or once it is complete, of the message; above 0.
  std::size_t bytes_missing() const;
  /// Pre: at most `bytes_missing()` bytes. Returns the message if they complete it. A string is an
  /// error in the message; all later calls return it again.
  Message take(std::span<const unsigned char> bytes);

 private:
  std::uint32_t joints_;
  ShaftBytes bytes_;       // of the incomplete message
  lk_shafts_head head_{};  // of the incomplete message; valid once all its bytes are there
  std::string wrong_;
};

/// Returns true if rotor and output of a gear count as one shaft for a simulator. The gear is then
/// too stiff for steps of this length (Coupling). Assumes no load on the output, as the load may be
/// absent or unknown. If false, the gear's spring stays in the drive's model.
bool is_one_shaft(const model::MechanicsParams& gear, SimTime step);

/// A joint that a simulator has accepted.
struct ShaftJoint {
  std::string name;  // "vcan0:1"
  lk_shafts_accept terms{};
  // State of the drive's output shaft now.
  double angle_rad = 0;
  double speed_rad_s = 0;
  double armature_kg_m2 = 0;
};

/// Joints of an external simulator (docs/guides/your-simulator.md) as a body. The simulator
/// computes its steps: `torques` returns the torques to send, and `take` stores the states
/// received.
class ShaftBody final : public Mechanism {
 public:
  ShaftBody(std::vector<ShaftJoint> joints, SimTime step);

  std::unique_ptr<Mechanism> clone() const override { return std::make_unique<ShaftBody>(*this); }
  SimTime step() const override { return step_; }
  std::span<const std::string> joints() const override { return names_; }
  JointView joint(std::size_t joint) const override;
  void set_armature(std::size_t joint, double inertia_kg_m2) override;
  void update() override {}
  /// Joints keep the drives' angle and speed until the simulator sends new states (`take`).
  void advance(std::span<const JointTorque> torques) override;
  /// The simulator owns all other parts, so lk-emu can push none.
  std::span<const std::string> parts() const override { return {}; }
  void push(std::size_t, const std::array<double, 3>&, const std::array<double, 3>&) override {}
  void carry(std::size_t, double) override {}
  void freeze(bool) override {}
  std::optional<std::string> failure() const override { return std::nullopt; }

  /// Returns the first error in the joints' `states`; nullopt if all are valid.
  std::optional<std::string> problem_of(std::span<const lk_shafts_state> states) const;
  /// Stores the states with which the simulator answers `torques`; before the first step, its
  /// initial states.
  void take(std::span<const lk_shafts_state> states);
  /// Mean torques over the `steps()` done since the last `take`. Pre: at least one.
  std::vector<lk_shafts_torque> torques() const;
  unsigned steps() const { return steps_; }

 private:
  struct Joint {
    lk_shafts_accept terms;
    lk_shafts_state state;           // now
    double armature_kg_m2;           // now
    double received_armature_kg_m2;  // armature that `state.inertia_kg_m2` includes
    std::optional<double> received_speed_rad_s = std::nullopt;  // in the last `take`
    double torque_Nm = 0;   // sum of the steps' mean torques since the last `take`
    double slope_Nm_s = 0;  // in the last step
  };
  static double inertia_of(const Joint& joint);
  /// Estimates the torque on a joint besides its drive, from its motion since the last `take`.
  double estimated_torque(const Joint& joint, double speed_rad_s) const;

  SimTime step_;
  std::vector<std::string> names_;
  std::vector<Joint> joints_;
  unsigned steps_ = 0;
};

}  // namespace lk::emulator
