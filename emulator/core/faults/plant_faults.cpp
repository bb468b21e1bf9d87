// Faults of the hardware: sensors, power stage, mechanics and supply. Each fault changes the
// `model::Faults` of earlier faults. DriveBank::takes_effect tells whether a fault is visible.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>

#include "emulator/core/faults/acts.hpp"
#include "emulator/core/faults/fault_rows.hpp"
#include "emulator/core/units.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {

double OnPlant::anchor() const {
  const auto place = std::ranges::find(live.fault.ids, servo.id) - live.fault.ids.begin();
  return live.anchors[static_cast<std::size_t>(place)];
}

namespace {

using enum FaultGroup;
using F = model::Faults;
using model::EncoderFault;
using model::LegFault;

enum class Phase : std::uint8_t { kA, kB, kC };
enum class Side : std::uint8_t { kHigh, kLow };
enum class Channel : std::uint8_t { kA, kB, kBoth };
enum class TemperatureSensor : std::uint8_t { kMotor, kDriver };

constexpr std::string_view kPhaseWords[] = {"a", "b", "c"};
constexpr std::string_view kSideWords[] = {"high", "low"};
constexpr std::string_view kChannelWords[] = {"a", "b", "both"};
constexpr std::string_view kSensorWords[] = {"motor", "driver"};
constexpr FaultParam kPhase = choice("phase", kPhaseWords, Phase::kA);
constexpr FaultParam kSide = choice("side", kSideWords, Side::kHigh);
constexpr FaultParam kChannel = choice("channel", kChannelWords, Channel::kA);
constexpr FaultParam kSensor = choice("sensor", kSensorWords, TemperatureSensor::kMotor);

/// Changes the current sensors that parameter 1 selects.
template <class Change>
void on_channels(const OnPlant& on, F& f, Change change) {
  const auto channel = on.choice<Channel>(1);
  if (channel != Channel::kB) change(f.current_a);
  if (channel != Channel::kA) change(f.current_b);
}

bool of_motor(const OnPlant& on) {
  return on.choice<TemperatureSensor>(1) == TemperatureSensor::kMotor;
}

/// Returns the rms value of the sum of two independent noises, from their rms values.
double with_noise(double noise, double more) { return std::sqrt(noise * noise + more * more); }

LegFault& leg(const OnPlant& on, F& f) {
  return f.legs[static_cast<std::size_t>(on.choice<Phase>(0))];
}
bool is_high(const OnPlant& on) { return on.choice<Side>(1) == Side::kHigh; }

/// Multiplies the factors of several faults of a kind. Clamps the product to the range of one
/// factor: a product of hundreds would be 0 or infinite.
void times(double& so_far, double factor, double least, double most) {
  so_far = std::clamp(so_far * factor, least, most);
}

/// Returns true if the supply is in the off part of the cycle of `reboot_loop`.
bool is_off(const OnPlant& on) {
  const auto ms = [](double value) { return SimTime(protocol::rounded(value * 1e6)); };
  return on.active % (ms(on.number(0)) + ms(on.number(1))) < ms(on.number(0));
}

std::string drive(const ServoConfig& servo) { return "drive " + std::to_string(servo.id); }

std::string without_current_sensors(const Fault&, const ServoConfig& servo) {
  return servo.profile.series == Series::kMs ? drive(servo) + " has no current sensors (MS series)"
                                             : "";
}

std::string without_play(const Fault&, const ServoConfig& servo) {
  const model::MechanicsParams& gear = servo.profile.drive.mechanics;
  const bool play = gear.backlash_out > 0 && gear.gear_stiffness_out > 0;
  return play ? "" : drive(servo) + " has no gear with play";
}

std::string without_brake(const Fault&, const ServoConfig& servo) {
  return servo.profile.drive.brake.tau > 0 ? "" : drive(servo) + " has no brake";
}

bool kick(AtOnce& on) {
  const auto speeds = [&on] {
    const model::Truth truth = on.motor.bank.truth(on.motor.index);
    return std::pair(truth.omega_m, truth.omega_out);
  };
  const auto before = speeds();
  on.motor.bank.kick(on.motor.index, on.live.number(0));
  return speeds() != before;
}

// Row: word, group and parameters, functions; description. Defaults are assumed.
// clang-format off
constexpr FaultRow kPlantRows[] = {
    {.word = "encoder_stuck", .group = kSensors, .plant = [](const OnPlant&, F& f) { f.encoder = EncoderFault::kStuck; },
     .about = {"the encoder keeps showing its last value", "编码器一直显示当时的值"}},
    {.word = "encoder_jump", .group = kSensors, .params = {needed("angle_deg", -36'000, 36'000)}, .plant = [](const OnPlant& on, F& f) { f.encoder_offset += on.number() * kRadPerDeg; },
     .about = {"the encoder is off by this angle of the rotor (slipped magnet)", "编码器偏这么多转子角度（磁铁打滑）"}},
    {.word = "encoder_noise", .group = kSensors, .params = {needed("rms_deg", 0, 180)},
     .plant = [](const OnPlant& on, F& f) { f.encoder_noise = with_noise(f.encoder_noise, on.number() * kRadPerDeg); },
     .about = {"noise on the encoder, rms, of the rotor", "编码器噪声，有效值，转子角度"}},
    {.word = "encoder_drift", .group = kSensors, .params = {needed("rate_dps", -36'000, 36'000)},
     .plant = [](const OnPlant& on, F& f) { f.encoder_offset += on.number() * kRadPerDeg * in_seconds(on.active); }, .varies_in_time = true,
     .about = {"the encoder drifts from the rotor at this rate", "编码器以这个速度漂离转子"}},
    {.word = "encoder_garbage", .group = kSensors, .plant = [](const OnPlant&, F& f) { f.encoder = EncoderFault::kGarbage; },
     .about = {"the encoder shows a random angle each time", "编码器乱报，每次都不同"}},
    {.word = "encoder_lost_magnet", .group = kSensors, .plant = [](const OnPlant&, F& f) { f.encoder = EncoderFault::kLostMagnet; },
     .about = {"the encoder has lost its magnet: its angle wanders around the last value", "编码器看不到磁铁了：在原处附近游移"}},
    {.word = "encoder_slow", .group = kSensors, .params = {number("latency_ms", 0, 100, 2)}, .plant = [](const OnPlant& on, F& f) { f.encoder_latency += on.number() * 1e-3; },
     .about = {"the encoder shows where the rotor was this long ago", "编码器显示的是这么久以前转子的位置"}},
    {.word = "current_offset", .group = kSensors, .params = {needed("offset_A", -1000, 1000), kChannel},
     .impossible = without_current_sensors, .plant = [](const OnPlant& on, F& f) { on_channels(on, f, [&](auto& channel) { channel.offset += on.number(); }); },
     .about = {"a current sensor is off by this much", "电流传感器偏这么多"}},
    {.word = "current_gain", .group = kSensors, .params = {needed("gain", -10, 10), kChannel},
     .impossible = without_current_sensors, .plant = [](const OnPlant& on, F& f) { on_channels(on, f, [&](auto& channel) { times(channel.gain, on.number(), -10, 10); }); },
     .about = {"a current sensor shows the current times this gain", "电流传感器显示实际电流的这么多倍"}},
    {.word = "current_noise", .group = kSensors, .params = {needed("rms_A", 0, 1000)},
     .impossible = without_current_sensors, .plant = [](const OnPlant& on, F& f) { f.current_noise = with_noise(f.current_noise, on.number()); },
     .about = {"noise on both current sensors, rms", "两个电流传感器的噪声，有效值"}},
    {.word = "current_stuck", .group = kSensors, .params = {number("value_A", -1000, 1000, 0), kChannel},
     .impossible = without_current_sensors, .plant = [](const OnPlant& on, F& f) { on_channels(on, f, [&](auto& channel) { channel.stuck = on.number(); }); },
     .about = {"a current sensor shows this, regardless of the current", "不管流过多少，电流传感器都显示这个值"}},
    {.word = "temperature_stuck", .group = kSensors, .params = {needed("value_C", -55, 250), kSensor},
     .plant = [](const OnPlant& on, F& f) { (of_motor(on) ? f.temp_motor_stuck : f.temp_driver_stuck) = on.number(); },
     .about = {"a temperature sensor shows this", "温度传感器显示这个值"}},
    {.word = "temperature_off", .group = kSensors, .params = {needed("offset_C", -300, 300), kSensor},
     .plant = [](const OnPlant& on, F& f) { (of_motor(on) ? f.temp_motor_offset : f.temp_driver_offset) += on.number(); },
     .about = {"a temperature sensor is off by this much", "温度传感器偏这么多"}},
    {.word = "voltage_stuck", .group = kSensors, .params = {needed("value_V", 0, 200)}, .plant = [](const OnPlant& on, F& f) { f.v_bus_stuck = on.number(); },
     .about = {"the voltage sensor shows this", "电压传感器显示这个值"}},
    {.word = "voltage_off", .group = kSensors, .params = {needed("offset_V", -200, 200)}, .plant = [](const OnPlant& on, F& f) { f.v_bus_offset += on.number(); },
     .about = {"the voltage sensor is off by this much", "电压传感器偏这么多"}},
    {.word = "phase_open", .group = kPowerStage, .params = {kPhase}, .plant = [](const OnPlant& on, F& f) { leg(on, f) = LegFault::kPhaseOpen; },
     .about = {"the wire of a phase is broken: no current flows in it", "一相断线：其中没有电流"}},
    {.word = "switch_open", .group = kPowerStage, .params = {kPhase, kSide}, .plant = [](const OnPlant& on, F& f) { leg(on, f) = is_high(on) ? LegFault::kHighOpen : LegFault::kLowOpen; },
     .about = {"a switch of a phase never closes; its diode still conducts", "一相的一个开关管不再导通；它的二极管仍然导通"}},
    {.word = "switch_shorted", .group = kPowerStage, .params = {kPhase, kSide}, .plant = [](const OnPlant& on, F& f) { leg(on, f) = is_high(on) ? LegFault::kHighShorted : LegFault::kLowShorted; },
     .about = {"a switch of a phase never opens: with its partner it shorts the link", "一相的一个开关管不再关断：与同臂的另一个管子一起把直流母线短路"}},
    {.word = "bridge_dead", .group = kPowerStage, .plant = [](const OnPlant&, F& f) { f.bridge_dead = true; },
     .about = {"no switch closes any more, and the firmware does not notice", "所有开关管都不再导通，而固件不知道"}},
    {.word = "calibration_lost", .group = kPowerStage, .params = {number("offset_deg", -180, 180, 90)}, .plant = [](const OnPlant& on, F& f) { f.commutation_offset += on.number() * kRadPerDeg; },
     .about = {"the drive commutates this far (electrical) beside the rotor, as after a calibration that failed: current without torque, or torque the wrong way round; its angles are right", "换相角偏这么多（电角度），如同校准失败：有电流没有转矩，或者转矩方向相反；显示的角度是对的"}},
    {.word = "jam", .group = kMechanics, .params = {number("percent", 0, 100, 100)}, .plant = [](const OnPlant& on, F& f) { f.jam = std::max(f.jam, on.number() / 100); },
     .about = {"the output is clamped: dry friction of this share of the motor's peak torque; 100: locked, regardless of the load", "输出轴被夹住：相当于电机峰值转矩这一百分比的干摩擦；100：锁死，怎么推都不动"}},
    {.word = "friction", .group = kMechanics, .params = {needed("factor", 0, 1000)}, .plant = [](const OnPlant& on, F& f) { times(f.friction, on.number(), 0, 1000); },
     .about = {"all friction is multiplied by this factor", "全部摩擦变成原来的这么多倍"}},
    {.word = "inertia", .group = kMechanics, .params = {needed("factor", 0.1, 1000)}, .plant = [](const OnPlant& on, F& f) { times(f.inertia, on.number(), 0.1, 1000); },
     .about = {"all inertia is multiplied by this factor", "所有转动部件的转动惯量变成原来的这么多倍"}},
    {.word = "load_step", .group = kMechanics, .params = {needed("torque_Nm", -1000, 1000)}, .plant = [](const OnPlant& on, F& f) { f.load_torque += on.number(); },
     .about = {"torque on the output in addition, positive pushes clockwise", "输出轴上附加的转矩，正值推向顺时针"}},
    {.word = "kick", .group = kMechanics, .params = {needed("impulse_Nms", -100, 100)}, .at_once = kick,
     .about = {"a blow on the output: this much angular momentum at once", "对输出轴的一次冲击：瞬间给这么多角动量"}},
    {.word = "backlash", .group = kMechanics, .params = {needed("factor", 0, 1000)}, .impossible = without_play, .plant = [](const OnPlant& on, F& f) { times(f.backlash, on.number(), 0, 1000); },
     .about = {"the gear's play is multiplied by this factor (motors with an elastic gear only)", "减速器的背隙变成原来的这么多倍（只限带弹性减速器的电机）"}},
    {.word = "coupling_broken", .group = kMechanics, .plant = [](const OnPlant&, F& f) { f.coupling_broken = true; },
     .about = {"rotor and load have come apart", "转子与负载脱开"}},
    {.word = "end_stop", .group = kMechanics, .params = {number("min_deg", -1e6, 0, -1e6), number("max_deg", 0, 1e6, 1e6)},
     .needs_one = true,
     .plant = [](const OnPlant& on, F& f) {
       f.theta_min = std::max(f.theta_min, on.anchor() + on.number(0) * kRadPerDeg);
       f.theta_max = std::min(f.theta_max, on.anchor() + on.number(1) * kRadPerDeg);
     },
     .about = {"an obstacle limits the output to these angles from its position", "有东西挡住输出轴：从所在位置出发，走不出这两个角度"}},
    {.word = "brake_late", .group = kMechanics, .params = {number("delay_ms", 0.01, 10'000, 100)}, .impossible = without_brake, .plant = [](const OnPlant& on, F& f) { f.brake_delay = std::max(f.brake_delay, on.number() * 1e-3); },
     .about = {"the brake begins to move this long after its coil was switched; the reply to 0x8C comes at once and shows the commanded state", "抱闸线圈通断之后这么久，抱闸才开始动作；0x8C 立即得到回复，内容是命令的状态"}},
    {.word = "fan_stuck", .group = kMechanics, .params = {number("factor", 1, 1000, 4)}, .plant = [](const OnPlant& on, F& f) { times(f.R_housing_ambient, on.number(), 1, 1000); },
     .about = {"air no longer moves over the housing: its thermal resistance to the surroundings is multiplied by this factor", "外壳上的空气不再流动：外壳到环境的热阻变成原来的这么多倍"}},
    {.word = "sag", .group = kPower, .params = {needed("to_V", 0, 100)}, .plant = [](const OnPlant& on, F& f) { f.v_source_max = std::min(f.v_source_max, on.number()); },
     .about = {"the supply voltage is limited to this value", "供电电源给不出更高的电压"}},
    {.word = "dip", .group = kPower, .params = {number("below_reset_V", 0, 60, 1)},
     .plant = [](const OnPlant& on, F& f) {
       const double below_reset_V = std::max(on.servo.profile.drive.logic.v_reset - on.number(), 0.0);
       f.v_source_max = std::min(f.v_source_max, below_reset_V);
     },
     .about = {"the supply falls this far below the voltage at which the controller is reset", "供电电压降到控制器复位电压以下这么多"}},
    {.word = "cut", .group = kPower, .plant = [](const OnPlant&, F& f) { f.supply_cut = true; },
     .about = {"the supply is disconnected", "供电断开"}},
    {.word = "reboot_loop", .group = kPower, .params = {number("off_ms", 1, 600'000, 1000), number("on_ms", 1, 600'000, 200)},
     .plant = [](const OnPlant& on, F& f) { f.supply_cut |= is_off(on); }, .varies_in_time = true,
     .about = {"the supply is switched off, on, and off again", "供电时有时无：断、通、再断"}},
    {.word = "no_regeneration", .group = kPower, .plant = [](const OnPlant&, F& f) { f.no_regeneration = true; },
     .about = {"the supply absorbs no energy (a rectifier): braking raises the voltage of the DC link", "电源不吸收回馈能量（整流电源）：制动使母线电压泵升"}},
};
// clang-format on

}  // namespace

std::span<const FaultRow> plant_faults() { return kPlantRows; }

}  // namespace lk::emulator
