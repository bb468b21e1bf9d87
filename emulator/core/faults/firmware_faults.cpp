// Faults of the firmware and its memory: restarts, hangs, lost writes, damaged settings.

#include <algorithm>

#include "emulator/core/faults/acts.hpp"
#include "emulator/core/faults/fault_rows.hpp"

namespace lk::emulator {
namespace {

using enum FaultGroup;

/// Indexed by RomParameter; the last word means all.
constexpr std::string_view kParameterWords[] = {
    "gains",          "acceleration", "encoder_offset", "max_torque_current",
    "max_power",      "max_speed",    "max_angle",      "current_ramp",
    "broadcast_mode", "protections",  "align_value",    "driver_id",
    "bus_type",       "rs485_rate",   "can_rate",       "all"};
constexpr std::span<const std::string_view> kAllWords = kParameterWords;
constexpr auto kAll = static_cast<RomParameter>(kRomParameters);

/// Rejects the limit that the drive's series does not use: on MS Max Torque Current, else Max
/// Power.
std::string without_parameter(const Fault& fault, const ServoConfig& servo) {
  const bool ms = servo.profile.series == Series::kMs;
  const auto parameter = fault.values[0].choice<RomParameter>();
  if (parameter != (ms ? RomParameter::kMaxTorqueCurrent : RomParameter::kMaxPower)) return "";
  return "drive " + std::to_string(servo.id) + " is limited by " +
         (ms ? "max_power" : "max_torque_current") + ", not by this parameter";
}

constexpr std::string_view kLostAfterWords[] = {"boot", "lost_input", "clear", "off"};

std::string answers_so_anyway(const Fault&, const ServoConfig& servo) {
  return servo.quirks.clear_reply == ClearReply::kAfter
             ? ""
             : "drive " + std::to_string(servo.id) + " answers so anyway (quirks.clear_reply)";
}

/// Values of OffHangs, without kNo.
enum class Scope : std::uint8_t { kDrive, kBus };
constexpr std::string_view kScopeWords[] = {"drive", "bus"};

std::string hangs_so_anyway(const Fault&, const ServoConfig& servo) {
  return servo.quirks.off_hangs == OffHangs::kNo
             ? ""
             : "drive " + std::to_string(servo.id) + " does so anyway (quirks.off_hangs)";
}

std::string starts_so_anyway(const Fault&, const ServoConfig& servo) {
  return servo.quirks.boot_multi_turn == BootMultiTurn::kSingleTurn
             ? ""
             : "drive " + std::to_string(servo.id) + " starts so anyway (quirks.boot_multi_turn)";
}

bool reset(AtOnce& on) {
  on.restart = true;
  return on.alive;
}

void hang(OnQuery& on) {
  if (!on.would_be_answered()) return;
  on.took_effect();
  on.fate = OnQuery::Fate::kIgnored;
}

void answer_late(OnReply& on) {
  for (Outgoing& one : on.out) one.ready += from_ms(on.live.number(0));
  on.live.took_effect(on.now, on.id);
}

bool damage_rom(AtOnce& on) {
  const auto parameter = on.live.choice<RomParameter>(0);
  bool changed = false;
  for (std::size_t n = 0; n < kRomParameters; ++n) {
    const auto one = static_cast<RomParameter>(n);
    if ((parameter != one && parameter != kAll) || !damage_rom(on.servo, one)) continue;
    changed = true;
    if (!on.memory.damage(one, on.servo.rom)) on.rom_writes.push_back(rom_write(on.servo));
  }
  return changed;
}

bool flip_ram(AtOnce& on) {
  on.live.draw();
  return on.alive && flip_ram(on.servo, on.live.choice<RomParameter>(0), on.live.random, on.motor);
}

bool change_id(AtOnce& on) {
  const int id = static_cast<int>(on.live.number(0));
  if (!on.alive || on.servo.address() == id) return false;
  change_id(on.servo, id);
  if (!on.memory.damage(RomParameter::kDriverId, on.servo.rom, 1)) {
    on.rom_writes.push_back(rom_write(on.servo));
  }
  return true;
}

// Row: word, group and parameters, functions; description.
// clang-format off
constexpr FaultRow kFirmwareRows[] = {
    {.word = "reset", .group = kFirmware, .at_once = reset,
     .about = {"the controller restarts: RAM, turn count, errors and command are lost", "控制器重新启动：RAM、圈数、错误标志和命令全部丢失"}},
    {.word = "hang", .group = kFirmware, .on_query = hang,
     .about = {"the drive neither receives nor sends, even after a power cycle; the motor keeps its last command", "驱动器既不接收也不发送，断电重启也一样；电机维持最后的命令"}},
    {.word = "slow_replies", .group = kFirmware, .params = {number("delay_ms", 0.01, 10'000, 5)}, .on_reply = answer_late,
     .about = {"each reply is delayed by this time; the command itself is executed at once", "每个回复都晚这么久才备好；命令帧要求的动作则立即执行"}},
    {.word = "clock_drift", .group = kFirmware, .params = {needed("percent", -20, 20)},
     .plant = [](const OnPlant& on, model::Faults& f) { f.clock_ratio = std::clamp(f.clock_ratio * (1 + on.number() / 100), 0.8, 1.2); },
     .about = {"the drive's clock is fast by this share: speeds, ramps and times have this error", "驱动器的时钟快了这一百分比：速度、斜坡、时间都跟着偏"}},
    {.word = "rom_write_fails", .group = kFirmware, .firmware = &FirmwareFaults::rom_write_fails,
     .about = {"a write to ROM is acknowledged and changes nothing there", "写 ROM 得到应答，但 ROM 里什么都没有变"}},
    {.word = "rom_worn", .group = kFirmware, .firmware = &FirmwareFaults::rom_worn,
     .about = {"the memory is worn out: written values are not kept", "存储器已到擦写寿命：写入的值不能保存"}},
    {.word = "rom_damaged", .group = kFirmware, .params = {choice("parameter", kAllWords, kAll)}, .at_once = damage_rom,
     .about = {"a parameter in ROM is lost: the next start uses its factory value", "ROM 中一个参数丢失：下次启动读到的是出厂值"}},
    {.word = "id_changed", .group = kFirmware, .params = {needed_count("new_id", protocol::kMinId, protocol::kMaxId)}, .at_once = change_id,
     .about = {"the drive answers at this ID from now on, and ROM keeps it", "驱动器从此以这个 ID 应答，并存入 ROM"}},
    {.word = "ram_flipped", .group = kFirmware, .params = {choice("parameter", kAllWords.first(9), RomParameter::kMaxSpeed)}, .impossible = without_parameter, .at_once = flip_ram,
     .about = {"a bit of a setting in RAM flips; the seed selects the bit", "RAM 中一个设置翻转一位，哪一位由种子决定"}},
    {.word = "forgets_broadcast", .group = kFirmware, .firmware = &FirmwareFaults::forgets_broadcast,
     .about = {"the drive starts with multi-drive mode off", "驱动器启动后广播模式是关闭的"}},
    {.word = "forgets_limits", .group = kFirmware, .firmware = &FirmwareFaults::forgets_limits,
     .about = {"the drive starts with the factory limits", "驱动器启动后各项限值是出厂值"}},
    {.word = "clear_reply_before", .group = kFirmware, .impossible = answers_so_anyway, .firmware = &FirmwareFaults::clear_reply_before,
     .about = {"the reply to 0x9B shows the errors from before it cleared them", "0x9B 的回复给出的是清除之前的错误标志"}},
    {.word = "first_command_lost", .group = kFirmware, .params = {choice("after", kLostAfterWords, LostAfter::kLostInput)},
     .firmware = &FirmwareFaults::first_command_lost, .firmware_detail = [](const LiveFault& live, FirmwareFaults& f) { f.lost_after = live.choice<LostAfter>(0); },
     .about = {"the first motion command after a start, a trip of lost input, 0x9B or 0x80 is answered and not executed; refused ones do not count", "启动、输入丢失保护动作、0x9B 或 0x80 之后的第一条运动命令得到回复却不执行；被拒绝的不算"}},
    {.word = "bus_held_after_off", .group = kFirmware, .params = {choice("scope", kScopeWords, Scope::kBus)}, .impossible = hangs_so_anyway,
     .firmware = &FirmwareFaults::hangs_after_off, .firmware_detail = [](const LiveFault& live, FirmwareFaults& f) { f.off_hangs = std::max(f.off_hangs, live.choice<Scope>(0) == Scope::kBus ? OffHangs::kBus : OffHangs::kDrive); },
     .about = {"after the echo of 0x80 the drive sends nothing until it restarts; on CAN, and with scope drive, it still receives and executes commands; on RS-485 it occupies the line, so no frame gets through", "0x80 得到回复之后，驱动器发的东西一帧也出不来，直到重新启动；在 CAN 上，或 scope 为 drive 时，它仍接收并执行命令；在 RS-485 上它占住线路，任何帧都传不出去"}},
    {.word = "encoder_wrap_at_boot", .group = kFirmware, .params = {count("turns", -100, 100, 1)},
     .firmware = &FirmwareFaults::encoder_wrap_at_boot, .firmware_detail = [](const LiveFault& live, FirmwareFaults& f) { f.turns_at_boot += static_cast<int>(live.number(0)); },
     .about = {"at each start the multi-turn angle is off by this number of rotor turns; the shaft has not moved and the single-turn angle is right", "每次启动后多圈角度都差这么多转子圈；轴没有动，单圈角度是对的"}},
    {.word = "multi_turn_zero_at_boot", .group = kFirmware, .impossible = starts_so_anyway, .firmware = &FirmwareFaults::multi_turn_zero_at_boot,
     .about = {"at each start the multi-turn angle is 0, regardless of the shaft angle", "每次启动后多圈角度都是 0，不管轴停在哪里"}},
};
// clang-format on

}  // namespace

std::span<const FaultRow> firmware_faults() { return kFirmwareRows; }

}  // namespace lk::emulator
