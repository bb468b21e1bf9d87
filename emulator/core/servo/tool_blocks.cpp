#include "emulator/core/servo/tool_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "emulator/core/seed.hpp"
#include "emulator/core/servo/registers.hpp"
#include "emulator/core/servo/stored_settings.hpp"
#include "protocol/serial_commands.hpp"
#include "protocol/wire.hpp"

namespace lk::emulator {

using protocol::Block;
using protocol::Payload;
using protocol::put_le;
using protocol::quantize;

namespace {

constexpr std::size_t kNameBytes = 20;
constexpr std::size_t kChipBytes = 12;

// Offsets of the settings (docs/reference/rs485.md).
constexpr std::size_t kBus = 1, kSerialRate = 2, kCanRate = 3, kBroadcastMode = 4, kSpin = 5;
constexpr std::size_t kProtectionStates = 6, kMotor_C = 14, kDriver_C = 15, kUnder_cV = 16;
constexpr std::size_t kOver_cV = 18, kOver_mA = 20, kOver_ms = 22, kStall_ms = 24, kLost_ms = 26;
constexpr std::size_t kGains = 50, kMaxTorque = 68, kMaxSpeed = 72, kMaxAngle = 80;
constexpr std::size_t kCurrentRamp = 88, kSpeedRamp = 92, kUniqueId = 96, kSaved = 100;
constexpr std::uint32_t kSavedMark = 0x55AA'1234;
constexpr std::uint8_t kOnSerial = 1;
constexpr std::uint8_t kCan1M = 4;

/// Order of the protection states in the block.
constexpr model::Error kInOrder[] = {model::Error::kMotorTemperature,
                                     model::Error::kDriverTemperature,
                                     model::Error::kUnderVoltage,
                                     model::Error::kOverVoltage,
                                     model::Error::kOverCurrent,
                                     model::Error::kShort,
                                     model::Error::kStall,
                                     model::Error::kLostInput};

std::uint8_t state_of(const model::Protection& protection) {
  if (!protection.enabled) return 1;
  return protection.recoverable ? 2 : 3;
}

void put_name(Payload& data, std::size_t at, std::string_view name) {
  std::copy_n(name.begin(), std::min(name.size(), kNameBytes),
              data.begin() + static_cast<std::ptrdiff_t>(at));
}

/// Returns the tool's number of an encoder type: 7 for 18 bits; assumed one less for each bit less.
std::uint8_t encoder_type(int bits) { return static_cast<std::uint8_t>(std::max(bits - 11, 0)); }

const model::Protection& of(const Registers& ram, model::Error error) {
  return ram.protections[static_cast<std::size_t>(error)];
}

std::uint8_t is_reversed(const ServoConfig& config) {
  return static_cast<std::uint8_t>(config.profile.drive.encoder.direction < 0);
}

/// Returns the configured version; without one, that of the manual with the drive's commands.
std::uint16_t firmware_version(const ServoConfig& config) {
  const std::uint16_t said = config.profile.product.firmware_version;
  if (said != 0) return said;
  const protocol::Dialect& dialect = config.quirks.dialect;
  return dialect.parameter_commands ? 236 : dialect.pid_commands ? 230 : 235;
}

std::uint16_t u16(double value) { return quantize<std::uint16_t>(value, 1); }

}  // namespace

Block product_block(const ServoConfig& config) {
  const Product& product = config.profile.product;
  const std::uint8_t bytes = config.quirks.dialect.product_info_bytes;
  Block block{.command = protocol::ReadProduct::kOpcode, .data = {}, .size = bytes};
  put_name(block.data, 0, product.driver);
  put_name(block.data, kNameBytes, product.motor.empty() ? config.profile.model : product.motor);
  const std::uint16_t firmware = firmware_version(config);
  std::size_t at = 2 * kNameBytes;
  if (bytes < 2 * kNameBytes + kChipBytes) {  // oldest manual: one byte per version, in tenths
    block.data[at++] = static_cast<std::uint8_t>(product.hardware_version / 10);
    block.data[at] = static_cast<std::uint8_t>(firmware / 10);
    return block;
  }
  std::copy(product.chip_id.begin(), product.chip_id.end(),
            block.data.begin() + static_cast<std::ptrdiff_t>(at));
  at += kChipBytes;
  // The motor file has one chip ID; drives of a bus have different ones (assumed rule).
  const int number = block.data[at - 1] + config.id - protocol::kMinId;
  block.data[at - 1] = static_cast<std::uint8_t>(number);
  for (const std::uint16_t version : {product.hardware_version, product.motor_version, firmware}) {
    put_le(block.data, at, version);
    at += 2;
  }
  return block;
}

std::uint16_t device_type(Series series) {
  switch (series) {
    case Series::kMs:
      return 0x2011;
    case Series::kMf:
      return 0x2021;
    case Series::kMg:
      return 0x2031;
    case Series::kMh:
      return 0x2041;
  }
  return 0;
}

Block settings_block(const ServoConfig& config, const Registers& ram,
                     const protocol::WireFormat& format) {
  Block block{.command = protocol::ReadSettingsBlock::kOpcode,
              .data = {},
              .size = protocol::kSettingsBytes};
  Payload& data = block.data;
  data[0] = static_cast<std::uint8_t>(config.id);
  data[kBus] = kOnSerial;
  data[kSerialRate] = drive_address(Registers{}, config).serial_rate;
  data[kCanRate] = kCan1M;
  data[kBroadcastMode] = static_cast<std::uint8_t>(ram.broadcast_mode);
  data[kSpin] = is_reversed(config);
  for (std::size_t n = 0; n < std::size(kInOrder); ++n) {
    data[kProtectionStates + n] = state_of(of(ram, kInOrder[n]));
  }
  data[kMotor_C] = quantize<std::uint8_t>(of(ram, model::Error::kMotorTemperature).threshold, 1);
  data[kDriver_C] = quantize<std::uint8_t>(of(ram, model::Error::kDriverTemperature).threshold, 1);
  put_le(data, kUnder_cV, u16(of(ram, model::Error::kUnderVoltage).threshold * 100));
  put_le(data, kOver_cV, u16(of(ram, model::Error::kOverVoltage).threshold * 100));
  put_le(data, kOver_mA, u16(of(ram, model::Error::kOverCurrent).threshold * 1000));
  put_le(data, kOver_ms, u16(of(ram, model::Error::kOverCurrent).delay * 1000));
  put_le(data, kStall_ms, u16(of(ram, model::Error::kStall).threshold * 1000));
  put_le(data, kLost_ms, u16(of(ram, model::Error::kLostInput).threshold * 1000));
  const auto& gains = ram.gains;
  const std::uint16_t all[] = {gains.angle_kp,   gains.angle_ki,   gains.angle_kd,
                               gains.speed_kp,   gains.speed_ki,   gains.speed_kd,
                               gains.current_kp, gains.current_ki, gains.current_kd};
  for (std::size_t n = 0; n < std::size(all); ++n) put_le(data, kGains + 2 * n, all[n]);
  const auto number = [&](protocol::ParameterId id) {
    return get_parameter(ram, id, format).number;
  };
  put_le(data, kMaxTorque,
         static_cast<std::int16_t>(number(protocol::ParameterId::kMaxTorqueCurrent)));
  put_le(data, kMaxSpeed, number(protocol::ParameterId::kMaxSpeed));
  put_le(data, kMaxAngle, std::int64_t{number(protocol::ParameterId::kMaxAngle)});
  put_le(data, kCurrentRamp,
         static_cast<std::int16_t>(in_16_bits(number(protocol::ParameterId::kCurrentRamp))));
  put_le(data, kSpeedRamp, number(protocol::ParameterId::kSpeedRamp));
  put_le(data, kUniqueId, static_cast<std::uint32_t>(config.id));
  put_le(data, kSaved, kSavedMark);
  return block;
}

void take_settings_block(const Payload& request, const protocol::WireFormat& format,
                         Registers& ram) {
  // The block begins after the command.
  const auto u16_at = [&](std::size_t at) {
    return protocol::get_le<std::uint16_t>(request, 1 + at);
  };
  const auto number_at = [&](std::size_t at) {
    return protocol::get_le<std::int32_t>(request, 1 + at);
  };
  ram.broadcast_mode = request[1 + kBroadcastMode] != 0;
  using protocol::ParameterId;
  const ParameterId loops[] = {ParameterId::kAngleGains, ParameterId::kSpeedGains,
                               ParameterId::kCurrentGains};
  for (std::size_t n = 0; n < std::size(loops); ++n) {
    const std::size_t at = kGains + 6 * n;
    set_parameter(ram, {loops[n], {u16_at(at), u16_at(at + 2), u16_at(at + 4)}, 0}, format);
  }
  const auto set = [&](ParameterId id, std::int32_t number) {
    set_parameter(ram, {id, {}, number}, format);
  };
  const std::int32_t ramp = get_parameter(ram, ParameterId::kCurrentRamp, format).number;
  set(ParameterId::kMaxTorqueCurrent, static_cast<std::int16_t>(u16_at(kMaxTorque)));
  set(ParameterId::kMaxSpeed, number_at(kMaxSpeed));
  const auto angle_cdeg = protocol::get_le<std::int64_t>(request, 1 + kMaxAngle);
  set(ParameterId::kMaxAngle,
      static_cast<std::int32_t>(std::clamp<std::int64_t>(angle_cdeg, 0, INT32_MAX)));
  const auto wanted_ramp = static_cast<std::int16_t>(u16_at(kCurrentRamp));
  if (wanted_ramp != in_16_bits(ramp)) set(ParameterId::kCurrentRamp, wanted_ramp);
  set(ParameterId::kSpeedRamp, number_at(kSpeedRamp));
}

Block calibration_block(const ServoConfig& config, const Registers& ram) {
  const bool geared = config.profile.series == Series::kMg;
  Block block{.command = protocol::ReadCalibration::kOpcode,
              .data = {},
              .size = geared ? protocol::kGearedCalibrationBytes : protocol::kCalibrationBytes};
  Payload& data = block.data;
  const model::DriveParams& drive = config.profile.drive;
  // Assumed: number of poles, since a real MG6010 with 14 pole pairs shows 28.
  data[0] = static_cast<std::uint8_t>(2 * drive.motor.pole_pairs);
  data[1] = encoder_type(drive.encoder.bits);
  data[2] = is_reversed(config);
  put_le(data, 4, ram.align_value);
  data[12] = 1;  // aligned
  const std::size_t offset = geared ? 80 : 16;
  put_le(data, offset, std::uint32_t{ram.encoder_offset});
  data[offset + 4] = 1;  // set
  if (geared) data[85] = quantize<std::uint8_t>(drive.mechanics.gear_ratio, 1);
  put_le(data, geared ? 104U : 24U, kSavedMark);
  return block;
}

}  // namespace lk::emulator
