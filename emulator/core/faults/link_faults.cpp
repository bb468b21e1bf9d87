// Faults of the link: frames to a drive, frames from a drive, and frames on the wire.

#include "emulator/core/faults/link_faults.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "emulator/core/bus/can_errors.hpp"
#include "emulator/core/faults/acts.hpp"
#include "emulator/core/faults/fault_rows.hpp"
#include "emulator/core/units.hpp"
#include "emulator/core/wire_timing.hpp"
#include "protocol/codec.hpp"
#include "protocol/command_info.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {

void Duplicates::add(const FaultBoard& faults, std::size_t fault, const Servo& original,
                     std::int64_t f_pwm_Hz, SimTime now) {
  const LiveFault& live = faults[fault];
  ServoConfig config = original.config;
  // A later write of the encoder offset does not move the shaft.
  config.boot_offset = config.boot_offset.value_or(config.rom.encoder_offset);
  config.rom = original.rom;
  const DriveAddress& address = original.bus_address;
  config.rom.driver_id = static_cast<std::uint8_t>(address.id);
  config.rom.bus_type = static_cast<std::uint8_t>(address.bus);
  config.rom.serial_rate = address.serial_rate;
  config.rom.can_rate = address.can_rate;
  model::DriveInit init = make_drive(config, faults.bus_seed());
  init.theta_m += live.row().duplicate(live);
  init.seed = mix(live.random + static_cast<std::uint64_t>(config.id));
  model::DriveBank motor({&init, 1});
  Servo servo(config, motor.telemetry(0));
  const DriveLink link{.owner = kFirstOwner + static_cast<std::uint32_t>(fault % kOwners) * 64U +
                                static_cast<std::uint32_t>(config.id)};
  drives_.push_back(
      {fault, link, f_pwm_Hz, ticks_until(now, f_pwm_Hz), std::move(motor), std::move(servo)});
}

std::size_t Duplicates::remove(std::size_t fault, Wire& wire, SimTime now) {
  std::size_t lost = 0;
  std::erase_if(drives_, [&](Drive& drive) {
    if (drive.fault != fault) return false;
    lost += drive.link.drop_all(wire, now);
    return true;
  });
  return lost;
}

void Duplicates::advance_to(SimTime t) {
  for (Drive& drive : drives_) {
    const std::int64_t tick = ticks_until(t, drive.f_pwm_Hz) - drive.first_tick;
    drive.motor.advance(std::max<std::int64_t>(tick - drive.motor.ticks(), 0));
  }
}

std::size_t Duplicates::process(SimTime at, const protocol::Frame& frame, Wire& wire,
                                FaultBoard& faults, SimTime now) {
  std::size_t answers = 0;
  for (Drive& drive : drives_) {
    Servo& servo = drive.servo;
    const auto addressed = protocol::address(frame);
    const int* const id = std::get_if<int>(&addressed);
    const bool for_several = id != nullptr && *id == protocol::kMultiDrive;
    if (id == nullptr || (!for_several && servo.address() != *id) || !servo.on_its_bus() ||
        !servo.at_its_rate() || servo.multi_drive_mode() != for_several ||
        drive.link.cannot_receive(wire, at)) {
      continue;
    }
    const auto understood = understand(servo, frame);
    const auto* const query = std::get_if<protocol::Query>(&understood);
    // A duplicate ignores 0x18, because a calibration needs timed steps.
    if (query == nullptr || std::holds_alternative<protocol::Calibrate>(query->command)) continue;
    const std::uint64_t writes_before = servo.stats.rom_writes;
    const protocol::Reply reply = handle(servo, *query, Lane{drive.motor, 0});
    if (take_restart(servo)) {
      drive.link.drop_all(wire, now);
      power_cycle(servo, Lane{drive.motor, 0});
    }
    if (std::holds_alternative<protocol::NoReply>(reply)) continue;
    const protocol::Frame answer = encode(servo, reply);
    const bool takes_time = wire.bitrate() > 0 || wire.serial() != nullptr;
    SimTime ready = takes_time ? at + servo.config.reply_time + kDuplicateLag : at;
    if (servo.stats.rom_writes != writes_before) {
      ready = std::max(ready, at + servo.config.flash.write_time);  // a duplicate has no Memory
    }
    faults[drive.fault].took_effect(now, servo.id(), &answer);
    drive.link.send(wire, {.ready = ready, .frame = answer});
    take_address_change(servo);
    ++answers;
  }
  return answers;
}

int& Duplicates::errors(std::uint32_t owner) {
  const auto owns = [owner](const Drive& drive) { return drive.link.owner == owner; };
  return std::ranges::find_if(drives_, owns)->link.errors;
}

using protocol::Frame;
using enum FaultGroup;

bool OnQuery::is_listening() const {
  return servo.multi_drive_mode() == (protocol::find_multi_drive(frame.id) != nullptr);
}

bool OnQuery::would_be_answered() const {
  return is_listening() && std::holds_alternative<protocol::Query>(understand(servo, frame));
}

namespace {

/// Frames that a fault acts on.
enum class Frames : std::uint8_t { kReplies, kQueries, kBoth };
constexpr std::string_view kFramesWords[] = {"replies", "queries", "both"};
constexpr FaultParam kFrames = choice("frames", kFramesWords, Frames::kReplies);

/// Returns true if parameter `n` of the fault selects these frames.
bool acts_on(const LiveFault& live, std::size_t n, Frames frames) {
  const auto chosen = live.choice<Frames>(n);
  return chosen == frames || chosen == Frames::kBoth;
}

template <class Lost>
void lose_if(OnReply& on, const Lost& lost) {
  on.lost += std::erase_if(on.out, [&](const Outgoing& one) {
    if (!lost()) return false;
    on.took_effect(one);
    return true;
  });
}

/// Calls `changed` for each frame that the fault hits. Returns true if the fault hit a frame.
template <class Change>
bool change(OnReply& on, const Change& changed) {
  bool any = false;
  for (Outgoing& one : on.out) {
    if (!on.live.hits()) continue;
    const Frame before = one.frame;
    changed(one);
    any = true;
    if (!(one.frame == before)) on.took_effect(one);
  }
  return any;
}

/// Flips different bits of the data: as many as parameter 0 says, or all if there are fewer.
void flip_bits(LiveFault& live, Frame& frame) {
  const auto bits = static_cast<std::size_t>(live.number(0));
  // Partial Fisher-Yates shuffle: the first `bits` entries are random and distinct.
  std::array<std::uint8_t, 64> deck{};
  for (std::size_t n = 0; n < deck.size(); ++n) deck[n] = static_cast<std::uint8_t>(n);
  const auto size = static_cast<std::size_t>(8 * std::min<int>(frame.dlc, 8));
  for (std::size_t n = 0; n < std::min(size, bits); ++n) {
    const auto rest = static_cast<double>(size - n);
    std::swap(deck[n], deck[n + static_cast<std::size_t>(live.draw() * rest)]);
    std::uint8_t& byte = frame.data[deck[n] / 8U];
    byte = static_cast<std::uint8_t>(byte ^ (1U << (deck[n] % 8U)));
  }
}

void drop_query(OnQuery& on) {
  if (acts_on(on.live, 0, Frames::kQueries) && on.would_be_answered() && on.live.hits()) {
    on.took_effect();
    on.fate = OnQuery::Fate::kLost;
  }
}

void drop_reply(OnReply& on) {
  if (acts_on(on.live, 0, Frames::kReplies)) lose_if(on, [&] { return on.live.hits(); });
}

void delay(OnReply& on) {
  for (Outgoing& one : on.out) {
    if (!on.live.hits()) continue;
    const double most_ms = on.live.number(1);
    const SimTime delay = from_ms(on.live.number(0) + (most_ms > 0 ? most_ms * on.live.draw() : 0));
    one.ready += delay;
    if (delay > SimTime{0}) on.took_effect(one);
  }
}

/// Queues the copies of a reply behind it, up to the capacity of the send queue.
void duplicate(OnReply& on) {
  const auto copies = static_cast<std::size_t>(on.live.number(0));
  std::vector<Outgoing> all;
  for (Outgoing& one : on.out) {
    all.push_back(one);
    one.held_back = false;
    if (!on.live.hits()) continue;
    on.took_effect(one);
    on.extra += copies;
    all.insert(all.end(), copies, one);
  }
  if (all.size() > Wire::kDriveQueue) {
    on.lost += all.size() - Wire::kDriveQueue;
    all.resize(Wire::kDriveQueue);
  }
  on.out = std::move(all);
}

void corrupt_query(OnQuery& on) {
  if (acts_on(on.live, 1, Frames::kQueries) && on.is_listening() && on.live.hits()) {
    flip_bits(on.live, on.frame);
    on.took_effect();
  }
}

void corrupt_reply(OnReply& on) {
  if (!acts_on(on.live, 1, Frames::kReplies)) return;
  change(on, [&](Outgoing& one) { flip_bits(on.live, one.frame); });
}

void repeat_last(OnReply& on) {
  if (!on.link.last_frame) return;
  on.stale = change(on, [&](Outgoing& one) {
    one.frame = on.link.last_frame->frame;
    one.after_rom_write = on.link.last_frame->after_rom_write;
  });
}

/// Holds back one reply at most. Acknowledgements of ROM writes keep their order: the code that
/// releases them when the write is durable relies on it.
void hold_back(OnReply& on) {
  const bool taken = on.link.held_back || on.out.empty() || on.out.front().held_back;
  if (!taken && on.out.front().after_rom_write == 0 && on.live.hits()) {
    on.out.front().held_back = true;
    on.took_effect(on.out.front());
  }
}

void cut_off(OnReply& on) {
  change(on, [&](Outgoing& one) {
    one.frame.dlc = static_cast<std::uint8_t>(on.live.number(0));
    std::fill(one.frame.data.begin() + one.frame.dlc, one.frame.data.end(), std::uint8_t{0});
  });
}

void change_id(OnReply& on) {
  change(on, [&](Outgoing& one) {
    const int offset = static_cast<int>(on.live.number(0));
    one.frame.id = (one.frame.id + static_cast<std::uint32_t>(offset)) & 0x7FFU;
  });
}

Babble babble(OnBabble& on) {
  Frame frame;
  frame.id = static_cast<std::uint32_t>(on.live.number(1));
  return {from_ms(on.live.number(0) * 1e-3), frame};
}

/// Sends garbage for some time after a start, or until the first answer of the drive.
Babble boot_garbage(OnBabble& on) {
  const SimTime pause = from_ms(5 + 15 * on.live.draw());
  if (on.running > from_ms(on.live.number(0)) || on.link.last_frame) return {pause, std::nullopt};
  Frame frame;
  frame.id = on.servo.reply_id();
  frame.dlc = static_cast<std::uint8_t>(on.live.draw() * 8);
  for (std::size_t n = 0; n < frame.dlc; ++n) {
    frame.data[n] = static_cast<std::uint8_t>(on.live.draw() * 256);
  }
  return {pause, frame};
}

/// Field of a reply with state 2 that a fault tears.
enum class Torn : std::uint8_t { kIq, kSpeed, kEncoder, kAny };
constexpr std::string_view kTornWords[] = {"iq", "speed", "encoder", "any"};
constexpr std::size_t kTornBytes[] = {2, 4, 6};  // offset of each field

bool has_state_2(const Frame& frame) {
  if (frame.kind != protocol::FrameKind::kData && frame.kind != protocol::FrameKind::kSerial) {
    return false;
  }
  const protocol::CommandInfo* const command = protocol::find_command(frame.data[0]);
  return command != nullptr &&
         std::ranges::find(command->reply, "speed", &protocol::Field::name) !=
             command->reply.end() &&
         !command->echoed;
}

/// Replaces the low byte of a field by that of the previous reply. On RS-485 the checksum remains
/// that of the unchanged reply.
void tear(OnReply& on) {
  if (!on.link.last_frame || !has_state_2(on.link.last_frame->frame)) return;
  change(on, [&](Outgoing& one) {
    if (!has_state_2(one.frame)) return;
    const auto field = on.live.choice<Torn>(0);
    const auto place = field == Torn::kAny ? static_cast<std::size_t>(on.live.draw() * 3)
                                           : static_cast<std::size_t>(field);
    const std::size_t byte = kTornBytes[place];
    const std::uint8_t before = on.link.last_frame->frame.data[byte];
    if (one.frame.data[byte] == before) return;
    if (!protocol::is_serial(one.frame)) {
      one.frame.data[byte] = before;
      return;
    }
    protocol::WireBytes bytes = protocol::wire_bytes(one.frame);
    bytes.bytes[protocol::kHeaderBytes + byte - 1] = before;
    one.frame = protocol::bytes_frame(bytes.view());
  });
}

bool disturb(OnWire& on) {
  if (on.serial) return false;  // RS-485 has no error flags
  if (on.bitrate == 0 ||
      on.live.destroyed >= std::uint64_t{kFlagsToPassive} * on.live.fault.ids.size()) {
    return false;
  }
  ++on.live.destroyed;
  return true;
}

void reject_queries(OnQuery& on) {
  if (!on.would_be_answered()) return;
  on.took_effect();
  on.fate = OnQuery::Fate::kLost;
}

/// Destroys a share of frames, by reflections. The share grows with the square of the bit rate and
/// with the cable length.
bool reflect(OnWire& on) {
  constexpr double kOfOneMissing = 0.01;  // share of frames at 1 Mbit/s on 2 m, assumed
  constexpr double kOfBothMissing = 0.5;  // share of frames at 1 Mbit/s on 2 m, assumed
  constexpr double kCable_m = 2;
  const double Mbit_s = static_cast<double>(on.bitrate) * 1e-6;
  const double worst = on.live.number(0) == 1 ? kOfOneMissing : kOfBothMissing;
  return on.live.draw() < worst * Mbit_s * Mbit_s * on.live.number(1) / kCable_m;
}

// Row: word, group and parameters, functions; description.
// clang-format off
constexpr FaultRow kLinkRows[] = {
    {.word = "drop", .group = kLink, .params = {kFrames}, .per_frame = true, .on_query = drop_query, .on_reply = drop_reply,
     .about = {"the frame is lost: the other side never sees it; a reply is lost before it takes the wire", "丢帧：另一方看不到这一帧；回复在占用总线之前就丢了"}},
    {.word = "delay", .group = kLink, .params = {needed("delay_ms", 0, 10'000), number("jitter_ms", 0, 10'000, 0)}, .per_frame = true, .on_reply = delay,
     .about = {"the drive delays the reply by this time plus a random time up to the jitter; later replies queue behind it", "回复在驱动器里等这么久才发，再随机加上至多 jitter 的抖动；后面的回复排在它之后"}},
    {.word = "duplicate", .group = kLink, .params = {count("copies", 1, 15, 1)}, .per_frame = true, .on_reply = duplicate,
     .about = {"the reply is repeated this many times, limited by the free places of the drive's queue of 16", "回复多发这么多次，以驱动器 16 帧的队列装得下为限"}},
    {.word = "corrupt", .group = kLink, .params = {count("bits", 1, 64, 1), kFrames}, .per_frame = true, .on_query = corrupt_query, .on_reply = corrupt_reply,
     .about = {"this many bits of the data, different ones each time, are flipped, and no CRC notices (a bad gateway or buffer)", "数据中有这么多位翻转，每次位置不同，而谁的 CRC 都没有发现（坏的网关或缓冲）"}},
    {.word = "stale", .group = kLink, .per_frame = true, .on_reply = repeat_last,
     .about = {"the drive repeats its previous reply instead of the new one; the first reply after a start is normal", "驱动器不发新回复，而重发上一个回复；启动后的第一个回复是正常的"}},
    {.word = "torn_reply", .group = kLink, .params = {choice("field", kTornWords, Torn::kAny)}, .per_frame = true, .on_reply = tear,
     .about = {"a 16-bit field of a reply with state 2 has the low byte of the previous reply and the high byte of this one", "状态 2 回复中一个 16 位字段的低字节来自上一次回复，高字节来自这一次"}},
    {.word = "reorder", .group = kLink, .per_frame = true, .on_reply = hold_back, .holds_back = true,
     .about = {"the reply is held back and sent after the next reply of the drive, or when the fault ends; replies to ROM writes are not held back", "回复被扣住，排到该驱动器下一个回复之后才发，或故障结束时发；ROM 写入的应答不扣"}},
    {.word = "wrong_dlc", .group = kLink, .params = {count("dlc", 0, 7, 4)}, .per_frame = true, .on_reply = cut_off,
     .about = {"the reply has this many bytes; the rest is cut off", "回复只有这么多字节，其余截掉"}},
    {.word = "wrong_id", .group = kLink, .params = {count("offset", -2047, 2047, 1)}, .per_frame = true, .on_reply = change_id,
     .about = {"the reply's identifier is off by this much, modulo 2048", "回复的标识符偏这么多，模 2048"}},
    {.word = "duplicate_id", .group = kLink, .params = {number("angle_deg", -360'000, 360'000, 90)}, .duplicate = [](const LiveFault& live) { return live.number(0) * kRadPerDeg; },
     .about = {"a second drive has the same ID: it receives the same frames, turns its own motor, which starts at this rotor angle from that of the drive, and replies too, slightly later; it has its own supply, and other faults do not affect it", "另有一个同 ID 的驱动器：接收相同的帧，转的是自己的电机，上电位置与原驱动器相差这么多（转子角度），也会应答，只是稍晚；它有自己的供电，别的故障不影响它"}},
    {.word = "silent", .group = kLink, .on_reply = [](OnReply& on) { lose_if(on, [] { return true; }); }, .silences = true,
     .about = {"the drive receives and executes commands, but sends nothing", "驱动器接收并执行命令，但什么也发不出来"}},
    {.word = "babbling", .group = kLink, .params = {number("period_us", 100, 10'000'000, 500), count("can_id", 0, 2047, 0)}, .babble = babble,
     .about = {"the drive keeps sending unrequested frames of 8 zero bytes; while the wire is busy, at most one of them queues", "驱动器没人问也不停地发：8 个字节的 0；总线被占时，排队等待的不超过一帧"}},
    {.word = "error_frames", .group = kLink, .of_bus = true, .per_frame = true, .destroys = [](OnWire& on) { return on.live.hits(); },
     .about = {"a bit error destroys the frame on the wire: all nodes see an error frame, and the sender sends it again, its error counter up by 8; at 256 it gives the frame up and leaves the bus for 128 times 11 bits", "位错误毁掉线上的帧：人人都看到错误帧，发送方重发，发送错误计数加 8；到 256 就放弃这一帧，离开总线 128 次 11 位的时间"}},
    {.word = "bus_off", .group = kLink, .params = {number("recovery_ms", 0, 3'600'000, 100)},
     .destroys = [](OnWire& on) { return on.live.is_of(on.sender); }, .recovery = [](const LiveFault& live) { return from_ms(live.number(0)); },
     .about = {"everything the drive sends is destroyed: its error counter climbs by 8 each time, to error-passive (128) and bus-off (256); its queued frames are then lost, it neither receives nor sends for 128 times 11 bits and the recovery time, and returns with its counters at 0", "驱动器发什么都被破坏：错误计数每次加 8，先到被动错误（128），再到 bus-off（256）；此时排队的帧全部丢掉，在 128 次 11 位加恢复时间内既听不见也不发，回来时计数为 0"}},
    {.word = "boot_garbage", .group = kLink, .params = {number("for_ms", 0.01, 10'000, 100)}, .babble = boot_garbage,
     .about = {"after each start the drive sends frames with its identifier, 0 to 7 bytes and random data, every 5 to 20 ms for this long, until it answers for the first time", "每次启动后，驱动器在这段时间内每 5 至 20 ms 发一帧：标识符是它自己的，0 至 7 个字节，数据随机，直到第一次应答"}},
    {.word = "wrong_bitrate", .group = kLink, .on_query = reject_queries, .destroys = disturb, .silences = true, .off_the_bus = true,
     .about = {"the drive has another bit rate than the bus: it neither receives nor sends, and destroys the first 16 frames with error flags, until it is error-passive", "驱动器的波特率与总线不同：既收不到也不发送，并用错误标志毁掉最初 16 帧，直到进入被动错误状态"}},
    {.word = "no_termination", .group = kLink, .params = {count("missing", 1, 2, 2), number("cable_m", 0.1, 1000, 2)}, .of_bus = true, .destroys = reflect,
     .about = {"terminating resistors are missing: of the frames on the wire, at 1 Mbit/s and on 2 m of cable, 1 % without one and half without both end in error frames, more with the cable and with the square of the bit rate", "缺少终端电阻：1 Mbit/s、2 m 线缆时，缺一个有 1 % 的帧以错误帧告终，缺两个则有一半；随线缆长度成正比、随波特率的平方增加"}},
    {.word = "queue_full", .group = kLink, .on_reply = [](OnReply& on) { for (const Outgoing& one : on.out) on.took_effect(one); }, .blocks = true,
     .about = {"the drive's send queue is blocked: replies collect in it, and when it is full (16) queries are ignored; queued replies are sent in order when the fault ends", "驱动器的发送队列什么也发不出去：回复在里面越积越多，满了（16）之后命令帧被忽略；故障结束后按顺序发出"}},
};
// clang-format on

}  // namespace

std::span<const FaultRow> link_faults() { return kLinkRows; }

}  // namespace lk::emulator
