#include "protocol/parameter_codec.hpp"

#include <algorithm>
#include <limits>

namespace lk::protocol {
namespace {

using Int16 = std::numeric_limits<std::int16_t>;

}  // namespace

bool known_parameter(std::uint8_t byte) {
  return std::ranges::find(kParameterIds, static_cast<ParameterId>(byte)) != kParameterIds.end();
}

Parameter get_parameter(const Payload& data) {
  Parameter parameter{.id = static_cast<ParameterId>(data[1]), .gains = {}, .number = 0};
  switch (parameter.id) {
    case ParameterId::kAngleGains:
    case ParameterId::kSpeedGains:
    case ParameterId::kCurrentGains:
      parameter.gains = {.kp = get_le<std::uint16_t>(data, 2),
                         .ki = get_le<std::uint16_t>(data, 4),
                         .kd = get_le<std::uint16_t>(data, 6)};
      break;
    case ParameterId::kMaxTorqueCurrent:
      parameter.number = get_le<std::int16_t>(data, 4);
      break;
    case ParameterId::kMaxSpeed:
    case ParameterId::kMaxAngle:
    case ParameterId::kCurrentRamp:
    case ParameterId::kSpeedRamp:
      parameter.number = get_le<std::int32_t>(data, 4);
      break;
  }
  return parameter;
}

void put_parameter(Payload& data, const Parameter& parameter) {
  data[1] = static_cast<std::uint8_t>(parameter.id);
  switch (parameter.id) {
    case ParameterId::kAngleGains:
    case ParameterId::kSpeedGains:
    case ParameterId::kCurrentGains:
      put_le(data, 2, parameter.gains.kp);
      put_le(data, 4, parameter.gains.ki);
      put_le(data, 6, parameter.gains.kd);
      break;
    case ParameterId::kMaxTorqueCurrent:
      put_le(data, 4,
             static_cast<std::int16_t>(
                 std::clamp<std::int32_t>(parameter.number, Int16::min(), Int16::max())));
      break;
    case ParameterId::kMaxSpeed:
    case ParameterId::kMaxAngle:
    case ParameterId::kCurrentRamp:
    case ParameterId::kSpeedRamp:
      put_le(data, 4, parameter.number);
      break;
  }
}

}  // namespace lk::protocol
