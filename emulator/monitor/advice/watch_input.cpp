#include "emulator/monitor/advice/watch_input.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

#include "emulator/core/servo/shaft_angles.hpp"
#include "emulator/core/units.hpp"
#include "emulator/core/wire_timing.hpp"
#include "protocol/command_info.hpp"

namespace lk::emulator {
namespace {

using protocol::Opcode;

/// CAN frame of 8 bytes without stuff bits, and a pause of 3 bits (docs/reference/protocol.md §5).
constexpr std::int64_t kShortestFrame_bits = 108 + 3;

/// RS-485 packet with LEN 0: five bytes of ten bits.
constexpr std::int64_t kShortestPacket_bits = 50;

SimTime shortest_answer(const ServoConfig& config, std::int64_t bitrate) {
  if (bitrate == 0) return SimTime{0};
  if (config.quirks.dialect.framing == protocol::Framing::kSerial) {
    return 2 * bits_duration(kShortestPacket_bits, bitrate) + config.reply_time -
           config.reply_spread;
  }
  return 2 * bits_duration(kShortestFrame_bits, bitrate) + config.reply_time;
}

/// Speed of the rotor at which the back-EMF equals the largest voltage of space-vector modulation.
double no_load_dps(const Profile& profile) {
  const model::DriveParams& drive = profile.drive;
  const double phase_peak_V = drive.supply.v_source / std::numbers::sqrt3;
  return dps_from_rad_s(phase_peak_V / (drive.motor.pole_pairs * drive.motor.psi_f));
}

/// One turn of the output, in 0.01° of the rotor.
std::uint32_t widest_circle_cdeg(const Profile& profile) {
  return static_cast<std::uint32_t>(protocol::kTurn_cdeg * profile.drive.mechanics.gear_ratio);
}

/// Returns a quantity of a command as a number. If it has slots, returns that of the drive's slot,
/// nullopt without such a slot.
std::optional<double> own(const auto& quantity, int id) {
  if constexpr (requires { quantity.size(); }) {
    const auto slot = static_cast<std::size_t>(id - protocol::kMinId);
    return slot < quantity.size() ? std::optional(static_cast<double>(quantity[slot]))
                                  : std::nullopt;
  } else {
    return static_cast<double>(quantity);
  }
}

/// Returns the quantity that a motion command sets, in degrees, dps, A or per mille.
std::optional<double> motion_value(const auto& command, int id) {
  if constexpr (requires { command.power_permille; }) return own(command.power_permille, id);
  if constexpr (requires { command.iq_A; }) return own(command.iq_A, id);
  if constexpr (requires { command.speed_dps; }) return own(command.speed_dps, id);
  std::optional<double> cdeg;
  if constexpr (requires { command.target_cdeg; }) cdeg = own(command.target_cdeg, id);
  if constexpr (requires { command.increment_cdeg; }) cdeg = own(command.increment_cdeg, id);
  return cdeg ? std::optional(*cdeg / 100) : std::nullopt;
}

/// Returns the opcode of a command for one drive, or of its equivalent for one drive.
template <class Command>
Opcode opcode_of(const Command& /*command*/) {
  if constexpr (requires { Command::kOpcode; }) {
    return Command::kOpcode;
  } else {
    return protocol::find_multi_drive(Command::kIdentifier)->each;
  }
}

}  // namespace

KnownDrive::KnownDrive(const ServoConfig& config, const BusConfig& bus)
    : id(config.id),
      format(protocol::wire_format(config.quirks.dialect, config.profile.series)),
      circle_cdeg(ShaftAngles(config.profile, config.quirks).circle_cdeg()),
      widest_circle_cdeg(emulator::widest_circle_cdeg(config.profile)),
      max_offset_counts(ShaftAngles(config.profile, config.quirks).max_wire_count()),
      no_load_dps(emulator::no_load_dps(config.profile)),
      shortest_answer(emulator::shortest_answer(config, bus.bitrate)),
      byte_time(bus.serial && bus.bitrate > 0 ? bits_duration(kSerialBitsPerByte, bus.bitrate)
                                              : SimTime{0}),
      receives_while_replying(bus.serial && bus.serial->receives_while_replying),
      adapter_worst(bus.adapter != nullptr ? bus.adapter->times.worst_round_trip() : SimTime{0}),
      endurance(config.flash.endurance),
      gear_ratio(config.profile.drive.mechanics.gear_ratio),
      rated_Nm(config.profile.rating.torque_rated_Nm),
      address(drive_address(config.rom, config).id),
      on_bus(is_on_its_bus(drive_address(config.rom, config), config) &&
             is_at_its_rate(drive_address(config.rom, config), config)),
      wear(config.wear) {
  look_at(config.rom);
}

void KnownDrive::observe(const Bus& bus) {
  const Servo& servo = bus.servo(id);
  const model::Telemetry telemetry = bus.telemetry(id);
  address = servo.address();
  on_bus = servo.on_its_bus() && servo.at_its_rate();
  alive = telemetry.alive;
  errors = telemetry.errors;
  run_state = servo.run_state_at(telemetry);
  angle_deg = servo.multi_turn_deg(telemetry);
  wear = servo.wear;
  refused_motion = servo.stats.refused_motion;
  starts = servo.starts;
  calibrating = servo.calibrating();
  if (calibrating) torque_Nm = bus.truth(id).tau_e * gear_ratio;
  unasked = bus.state().nodes.of(id).unasked.last();
  clear_reply_before = servo.clear_reply_before();
  look_at(servo.ram);
}

void KnownDrive::look_at(const Registers& ram) {
  multi_drive = ram.broadcast_mode;
  max_speed_dps = ram.max_speed_dps;
  max_angle_deg = ram.max_angle_deg;
  const auto& input = ram.protections[static_cast<std::size_t>(model::Error::kLostInput)];
  input_window.reset();
  if (input.enabled) {
    input_window =
        std::chrono::round<SimTime>(std::chrono::duration<double>(input.threshold + input.delay));
  }
}

bool KnownDrive::can_be_asked() const {
  return !multi_drive || protocol::knows_multi_drive(format, protocol::MultiCommand::kIdentifier);
}

double KnownDrive::fastest_dps(double asked_dps) const {
  const double possible_dps = std::min(no_load_dps, max_speed_dps);
  return asked_dps > 0 ? std::min(possible_dps, asked_dps) : possible_dps;
}

std::optional<MotionCommand> motion_of(const protocol::Command& command, int id) {
  const auto motion = [id](const auto& one) -> std::optional<MotionCommand> {
    const std::optional<double> value = motion_value(one, id);
    if (!value) return std::nullopt;
    MotionCommand wanted{opcode_of(one), *value};
    if constexpr (requires { one.max_speed_dps; }) wanted.max_speed_dps = one.max_speed_dps;
    return wanted;
  };
  return std::visit(motion, command);
}

namespace {

// clang-format off
constexpr BilingualText kNoAnswer{"{1} queries in a row without an answer, within {2} s",
                          "连续 {1} 条命令帧没有回复，历时 {2} s"};
constexpr BilingualText kTooEarly{"{1} times a query {2} ms after the one before, whose reply came all the same; through this adapter it may take {3} ms",
                          "有 {1} 次在上一条之后 {2} ms 就发了命令帧，而回复还是到了；经过这个适配器最多要 {3} ms"};
// clang-format on

/// Returns true if the frame has a temperature, or the value that was read, where a query has 0.
bool is_reply(const protocol::Frame& frame) {
  if (protocol::has_state(frame.data[0])) return frame.data[1] != 0;
  const protocol::CommandInfo* const command = protocol::find_command(frame.data[0]);
  const bool asks = command != nullptr && command->query.empty() && !command->echoed;
  return asks && std::any_of(frame.data.begin() + 1, frame.data.end(),
                             [](std::uint8_t byte) { return byte != 0; });
}

}  // namespace

std::optional<Finding> DeadWatch::on_query(const TimedFrame& in, int id) {
  Polled& polled = polled_[static_cast<std::size_t>(id)];
  polled.elsewhere = polled.elsewhere || is_reply(in.frame);
  const bool alone = std::exchange(asked_last_, id) == id;
  if (polled.elsewhere) return std::nullopt;
  if (polled.in_a_row == 0 || in.at - polled.last > kPause || alone) {
    polled.since = in.at;
    polled.in_a_row = 0;
  }
  polled.last = in.at;
  polled.in_a_row = std::min(polled.in_a_row + 1, kInARow + 1);
  if (polled.in_a_row <= kInARow || in.at - polled.since < kLong) return std::nullopt;
  return finding(AdviceKind::kPollsDead, kNoAnswer, kInARow, in_seconds(in.at - polled.since));
}

void DeadWatch::on_reply(int id) { polled_[static_cast<std::size_t>(id)].in_a_row = 0; }

std::optional<Finding> TimeoutWatch::on_query(const DecodedQuery& query, const KnownDrive& drive) {
  if (drive.adapter_worst == SimTime{0}) return std::nullopt;
  const SimTime gap = query.gap.value_or(query.at);
  const SimTime worst = drive.shortest_answer + drive.adapter_worst;
  if (gap > worst) waiting_ = 0;  // the previous reply is lost
  // A gap shorter than any answer means that the host does not wait at all: another mistake.
  early_ = waiting_ > 0 && gap >= drive.shortest_answer && gap <= worst;
  ++waiting_;
  if (times_ < kTimes) return std::nullopt;
  if (!early_) return std::nullopt;
  return finding(AdviceKind::kTimeoutBelowLatency, kTooEarly, times_, 1000 * in_seconds(gap),
                 1000 * in_seconds(worst));
}

void TimeoutWatch::on_reply() {
  waiting_ = std::max(waiting_ - 1, 0);
  if (early_ && waiting_ > 0) times_ = std::min(times_ + 1, kTimes);
  early_ = false;
}

}  // namespace lk::emulator
