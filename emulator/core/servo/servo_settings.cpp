/// @file Commands of the second edition of the V2.36 manual only: settings over the bus, restart
/// and calibration (docs/reference/protocol.md §10.9). Also 0x37 and 0x38 of older drives.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "emulator/core/servo/registers.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/units.hpp"
#include "protocol/field_values.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {

using protocol::ParameterId;
using protocol::Reply;

namespace {

/// Each number of a query is within the range in its row.
bool is_within_ranges(const protocol::Query& query, const protocol::WireFormat& format) {
  const auto& info = protocol::info_of(query.command, format.dialect.framing);
  return std::ranges::all_of(info.query, [&](const protocol::Field& field) {
    if (!protocol::present(field, query.data, format)) return true;
    const std::int64_t number = protocol::raw(field, query.data);
    if (!field.values.empty()) {
      return std::ranges::find(field.values, static_cast<unsigned>(number),
                               &protocol::Value::number) != field.values.end();
    }
    const protocol::RawRange range = protocol::raw_range(field, format);
    return number >= range.min && number <= range.max;
  });
}

}  // namespace

// --- settings

Registers Servo::pending() const {
  Registers all = rom_;
  for (std::size_t p = 0; p < kRomParameters; ++p) {
    if (pending_parameters_[p]) copy_parameter(static_cast<RomParameter>(p), pending_, all);
  }
  return all;
}

protocol::StoredSetting Servo::shown_setting(const protocol::StoredSetting& which) const {
  const bool shows_pending = config_.quirks.setting_read == SettingRead::kPending;
  return get_stored(shows_pending ? pending() : ram_, which, config_, format_);
}

Reply Servo::on(const protocol::ReadStoredSetting& command, const Context&) const {
  return protocol::StoredSettingValue{shown_setting(command.setting)};
}

Reply Servo::on(const protocol::WriteStoredSetting& command, const Context& context) {
  const bool as_read = command.setting == shown_setting(command.setting);
  if (as_read || is_within_ranges(context.query, format_)) {
    pending_ = pending();
    set_stored(pending_, command.setting, config_, format_);
    pending_parameters_.set(
        static_cast<std::size_t>(rom_parameter_of(command.setting.id(), format_.series)));
    if (config_.quirks.id_change == IdChange::kWrite) schedule_address_change();
  }
  return protocol::StoredSettingValue{get_stored(pending(), command.setting, config_, format_),
                                      protocol::WriteStoredSetting::kOpcode};
}

Reply Servo::on(const protocol::SaveSettings& command, const Context&) {
  if (pending_parameters_.none()) return protocol::SettingsSaved{command.table, true};
  std::vector<RomParameter> written;
  for (std::size_t p = 0; p < kRomParameters; ++p) {
    if (pending_parameters_[p]) written.push_back(static_cast<RomParameter>(p));
  }
  const bool saved = write_rom(written, pending());
  if (saved) {
    saved_ = std::exchange(pending_parameters_, {});
    if (config_.quirks.id_change == IdChange::kSave) schedule_address_change();
  }
  return protocol::SettingsSaved{command.table, saved};
}

void Servo::restore_rom(const Registers& rom, const RomWear& wear) {
  rom_ = rom;
  wear_ = wear;
  // Settings that 0x44 could not store wait for it again.
  for (std::size_t p = 0; p < kRomParameters; ++p) {
    Registers with = rom;
    copy_parameter(static_cast<RomParameter>(p), pending_, with);
    if (saved_[p] && with != rom) pending_parameters_.set(p);
  }
  saved_.reset();
}

void Servo::schedule_address_change() {
  address_change_pending_ = true;
  // For kOld the reply leaves first: Bus::answer calls take_address_change() after it.
  if (config_.quirks.id_change_reply == IdChangeReply::kNew) {
    bus_address_ = drive_address(pending(), config_);
  }
}

bool Servo::take_address_change() {
  if (!std::exchange(address_change_pending_, false)) return false;
  const Registers next = pending();
  for (const auto parameter : {RomParameter::kDriverId, RomParameter::kBusType,
                               RomParameter::kSerialRate, RomParameter::kCanRate}) {
    copy_parameter(parameter, next, ram_);
  }
  bus_address_ = drive_address(ram_, config_);
  return true;
}

void Servo::change_id(int id) {
  rom_.driver_id = static_cast<std::uint8_t>(id);
  ++wear_[static_cast<std::size_t>(RomParameter::kDriverId)];
  ++stats_.rom_writes;
  ram_.driver_id = rom_.driver_id;
  bus_address_ = drive_address(ram_, config_);
}

Reply Servo::on(const protocol::Restart&, const Context&) {
  restarts_ = true;
  return protocol::NoReply{};
}

// --- Max Torque Current of older drives

Reply Servo::on(const protocol::ReadMaxTorque&, const Context&) const {
  return protocol::MaxTorque{get_parameter(ram_, ParameterId::kMaxTorqueCurrent, format_).number};
}

Reply Servo::on(const protocol::WriteMaxTorque& command, const Context& context) {
  const std::int32_t now = get_parameter(ram_, ParameterId::kMaxTorqueCurrent, format_).number;
  const std::int32_t most = std::max(protocol::kMaxTorque_lsb, now);
  set_parameter(ram_, {ParameterId::kMaxTorqueCurrent, {}, std::min(command.max_torque_lsb, most)},
                format_);
  configure(context.lane);
  return echo(context);
}

// --- calibration

Reply Servo::on(const protocol::Calibrate&, const Context& context) {
  if (calibrating()) return protocol::NoReply{};  // the running one continues
  if (run_state_ == RunState::kOff || context.before.errors != 0) return protocol::Calibrated{};
  motion_ = {};
  run_state_ = RunState::kRunning;
  calibration_ = Calibration{.turned_back = false, .from = angles_.position(context.before)};
  context.lane.command(model::Lead{lead_speed()});
  return protocol::NoReply{};
}

/// rad/s, electrical: two turns in half of the calibration time.
double Servo::lead_speed() const {
  const double half_s = 0.5 * std::chrono::duration<double>(config_.calibrate_time).count();
  return kCalibrationTurns * 2 * std::numbers::pi / half_s;
}

bool Servo::turn_back(const Lane& lane) {
  const model::Telemetry now = lane.telemetry();
  turn_off_after_trip(now);
  if (!calibration_ || calibration_->turned_back || run_state_ != RunState::kRunning) return false;
  const std::int64_t position = angles_.position(now);
  calibration_->travel += std::abs(position - calibration_->from);
  calibration_->from = position;
  calibration_->turned_back = true;
  lane.command(model::Lead{-lead_speed()});
  return true;
}

Reply Servo::finish_calibration(const Lane& lane, std::uint64_t random) {
  const model::Telemetry now = lane.telemetry();
  turn_off_after_trip(now);
  ++stats_.replies;
  Calibration done = *std::exchange(calibration_, std::nullopt);
  if (run_state_ != RunState::kRunning || !done.turned_back) return protocol::Calibrated{};
  lane.command(model::Idle{});
  done.travel += std::abs(angles_.position(now) - done.from);
  const model::DriveParams& drive = config_.profile.drive;
  const auto counts = static_cast<double>(std::int64_t{1} << drive.encoder.bits);
  const double commanded = 2 * kCalibrationTurns * counts / drive.motor.pole_pairs;
  const double ratio = std::min(1000 * static_cast<double>(done.travel) / commanded, 65535.0);
  protocol::Calibrated reply{
      .align_value = static_cast<std::uint32_t>(random % static_cast<std::uint64_t>(counts)),
      .align_ratio = static_cast<std::uint16_t>(protocol::rounded(ratio))};
  if (drive.encoder.direction < 0) reply.status |= protocol::kPhasesReversed;
  if (ratio < kLeastAlignRatio || ratio > kMaxAlignRatio) return reply;
  reply.status |= protocol::kCalibrationDone;
  Registers wanted = rom_;
  wanted.align_value = static_cast<std::int32_t>(reply.align_value);
  ram_.align_value = wanted.align_value;
  constexpr RomParameter kAlign = RomParameter::kAlignValue;
  write_rom({&kAlign, 1}, wanted);
  return reply;
}

}  // namespace lk::emulator
