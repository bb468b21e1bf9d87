#include "host/shoulder_joint.hpp"

#include <cmath>
#include <cstddef>

namespace robot {
namespace {

using namespace std::chrono_literals;

constexpr std::uint8_t kRun = 0x88;
constexpr std::uint8_t kReadAngle = 0x92;
constexpr std::uint8_t kReadState1 = 0x9A;
constexpr std::uint8_t kClearErrors = 0x9B;
constexpr std::uint8_t kMoveTo = 0xA4;
constexpr double kArrived_deg = 0.1;

}  // namespace

ShoulderJoint::ShoulderJoint(CanPort& port, int drive_id)
    : port_(port), can_id_(0x140U + static_cast<std::uint32_t>(drive_id)) {}

CanFrame ShoulderJoint::query(std::uint8_t command) const { return {can_id_, {command}}; }

std::optional<CanFrame> ShoulderJoint::ask(const CanFrame& query) {
  port_.send(query);
  while (auto reply = port_.receive(5ms)) {
    if (reply->id == can_id_ && reply->data[0] == query.data[0]) {
      return reply;
    }
  }
  return std::nullopt;
}

std::optional<double> ShoulderJoint::angle_deg() {
  const auto reply = ask(query(kReadAngle));
  if (!reply) {
    return std::nullopt;
  }
  std::uint64_t bits = 0;  // 56 bits, in bytes 1 to 7
  for (std::size_t k = 7; k >= 1; --k) {
    bits = bits << 8U | reply->data[k];
  }
  const auto angle_cdeg = static_cast<std::int64_t>(bits << 8U) >> 8U;
  return static_cast<double>(angle_cdeg) / 100;
}

std::optional<Health> ShoulderJoint::health() {
  const auto reply = ask(query(kReadState1));
  if (!reply) {
    return std::nullopt;
  }
  const auto& data = reply->data;
  return Health{
      .temperature_C = static_cast<std::int8_t>(data[1]),
      .voltage_V = (data[3] + 256 * data[4]) / 10.0,
      .under_voltage = (data[7] & 0x01U) != 0,
      .too_hot = (data[7] & 0x08U) != 0,
  };
}

bool ShoulderJoint::move_to(double target_deg, int speed_dps) {
  CanFrame move = query(kMoveTo);
  const auto speed = static_cast<std::uint16_t>(speed_dps);
  const auto target_cdeg = static_cast<std::uint32_t>(std::lround(target_deg * 100));
  move.data[2] = static_cast<std::uint8_t>(speed);
  move.data[3] = static_cast<std::uint8_t>(speed >> 8U);
  for (std::size_t k = 0; k < 4; ++k) {
    move.data[4 + k] = static_cast<std::uint8_t>(target_cdeg >> 8U * k);
  }
  return ask(move).has_value();
}

bool ShoulderJoint::recover() {
  return ask(query(kClearErrors)).has_value() && ask(query(kRun)).has_value();
}

bool ShoulderJoint::move_and_wait(double target_deg, int speed_dps,
                                  std::chrono::milliseconds timeout) {
  if (!move_to(target_deg, speed_dps)) {
    return false;
  }
  for (auto waited = 0ms; waited < timeout; waited += 10ms) {
    port_.wait(10ms);
    const auto angle = angle_deg();
    if (!angle) {
      return false;
    }
    if (std::abs(*angle - target_deg) <= kArrived_deg) {
      return true;
    }
  }
  return false;
}

}  // namespace robot
