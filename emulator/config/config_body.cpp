#include "emulator/config/config_body.hpp"

#include <algorithm>
#include <stdexcept>

#include "emulator/config/motor_file.hpp"
#include "emulator/core/units.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {
namespace {

constexpr double kShortest_ms = 0.05;  // of a body step; assumed
constexpr double kLongest_ms = 10;     // assumed: no position loop of a drive is as slow

constexpr double kLeast_ohm = 1e-4;  // assumed: less has no visible effect at a robot's currents
constexpr double kMax_ohm = 10;      // assumed: with more, no drive of a robot starts

/// Checks that a body step is a whole number of the drive's PWM periods.
void check_step(const TableReader& reader, const ServoConfig& servo, SimTime step) {
  const auto f_Hz = protocol::rounded(servo.profile.drive.inverter.f_pwm);
  if (f_Hz * step.count() % 1'000'000'000 == 0) return;
  reader.fail("joint", "the body's step_ms, " +
                           plain_number(static_cast<double>(step.count()) / 1e6) +
                           ", is not a multiple of this drive's PWM period (f_pwm_kHz = " +
                           plain_number(static_cast<double>(f_Hz) / 1e3) + ")");
}

void check_alone(const TableReader& reader) {
  if (reader.has("load"))
    reader.fail("load", "not allowed for a drive with a joint: the body is its load");
  if (reader.has("boot_angle_deg")) {
    reader.fail("boot_angle_deg",
                "not allowed for a drive with a joint: the body sets its angle; use offset_deg");
  }
}

}  // namespace

std::shared_ptr<const Mechanism> read_body(TableReader& reader, const LoadBody& load) {
  auto body = reader.table("body");
  if (!body) return nullptr;
  if (!load) {
    reader.fail("body", "this robot needs the package lk-emu-body: run lk-emu-body instead");
  }
  const std::string model = body->required("model", body->text("model"));
  const double step_ms = body->number("step_ms", kShortest_ms, kLongest_ms).value_or(1.0);
  body->finish();
  try {
    return load(reader.file(), model, std::chrono::microseconds(protocol::rounded(step_ms * 1e3)));
  } catch (const std::invalid_argument& problem) {
    body->fail("model", problem.what());
  }
}

double read_battery(TableReader& reader) {
  auto battery = reader.table("battery");
  if (!battery) return 0.0;
  const double R_ohm = battery->required("R_ohm", battery->number("R_ohm", kLeast_ohm, kMax_ohm));
  battery->finish();
  return R_ohm;
}

std::optional<JointLink> read_joint(TableReader& reader, const ServoConfig& servo,
                                    const Mechanism* body) {
  if (!reader.has("joint")) return std::nullopt;
  if (body == nullptr) reader.fail("joint", "the robot has no [body]");
  check_alone(reader);
  check_step(reader, servo, body->step());
  const std::vector<std::string> names(body->joints().begin(), body->joints().end());
  JointLink link;
  if (reader.is_text("joint")) {
    link.joint = *reader.choice("joint", names);
  } else {
    auto joint = *reader.table("joint");
    link.joint = joint.required("name", joint.choice("name", names));
    const auto direction = joint.integer("direction", -1, 1).value_or(1);
    if (direction == 0) joint.fail("direction", "must be 1 or -1");
    const double ratio = joint.number("ratio", 1e-3, 1e3).value_or(1.0);
    const double offset_deg = joint.number("offset_deg", -360, 360).value_or(0.0);
    joint.finish();
    link.rate = static_cast<double>(direction) * ratio;
    link.offset_rad = offset_deg * kRadPerDeg;
  }
  link.start_rad = body->joint(link.joint).angle_rad;
  return link;
}

void check_joint(const TableReader& reader, const ServoConfig& servo, std::vector<bool>& taken) {
  if (!servo.joint) return;
  if (taken[servo.joint->joint]) {
    reader.fail("joint", "another drive turns this joint already");
  }
  taken[servo.joint->joint] = true;
}

}  // namespace lk::emulator
