#include "emulator/monitor/advice/bus_watches.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "protocol/command_info.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {
namespace {

// clang-format off
constexpr BilingualText kCrowded{"{1} frames wait for the wire, and {2} did not even find room in the send queue",
                         "有 {1} 帧在等待上线，另有 {2} 帧连发送队列都没排进"};
// clang-format on

}  // namespace

std::optional<Finding> WireWatch::on_query() const {
  if (!too_fast_) return std::nullopt;
  return finding(AdviceKind::kFasterThanWire, kCrowded, waiting_, lost_);
}

void Disturbances::note_slip(SimTime now) {
  slip_until_ = now + kAftermath;
  extend(now);
}

void Disturbances::observe(const Bus& bus, const BusStats& stats) {
  // A babbling drive or a disturbed wire is not the host's fault.
  const std::uint64_t foreign = stats.extra_frames + stats.error_frames;
  if (foreign > std::exchange(foreign_, foreign) || bus.state().replies_are_held())
    extend(bus.time());
  // Frames that wait for an acknowledgement are not the host's fault either.
  if (bus.state().host.unacknowledged || bus.state().host.to_replay > 0) extend(bus.time());
  stalled_until_ = bus.state().adapter.stalled_until();
  if (stalled_until_ > SimTime{0}) extend(stalled_until_);
}

void WireWatch::observe(const Bus& bus, const BusStats& stats, bool disturbed) {
  const SimTime now = bus.time();
  waiting_ = stats.frames_waiting > kWaiting
                 ? bus.state().wire([&](auto& wire) { return wire.host_frames_ready(bus.time()); })
                 : stats.frames_waiting;
  const std::uint64_t lost = stats.count(Reject::kQueueFull);
  const bool runs_over = lost > std::exchange(lost_, lost) && waiting_ > kWaiting;
  if (waiting_ <= kWaiting || disturbed) {
    crowded_since_.reset();
  } else if (!crowded_since_) {
    crowded_since_ = now;
  }
  too_fast_ = (runs_over && !disturbed) || (crowded_since_ && now - *crowded_since_ >= kLong);
}

namespace {

// clang-format off
constexpr BilingualText kTooSoon{"{1} queries in a row without waiting: this one came {2} µs after the one before, whose reply takes at least {3} µs",
                         "连续 {1} 条命令帧不等回复：这一条在上一条之后 {2} µs 就来了，而上一条的回复至少要 {3} µs"};
constexpr BilingualText kPause{"nothing for {1} ms; lost input trips after {2} ms",
                       "{1} ms 没有任何帧；{2} ms 后输入丢失保护就会动作"};
// clang-format on

double ms(SimTime time) { return std::chrono::duration<double, std::milli>(time).count(); }

}  // namespace

std::optional<Finding> not_waited(const DecodedQuery& query, const KnownDrive& drive,
                                  int& in_a_row) {
  // Above the 16 replies that a drive queues, so that a burst is allowed
  // (docs/reference/protocol.md §5).
  constexpr int kInARow = 20;
  // Equal times: the simulated clock stood still or slipped, so the real gap is unknown.
  const SimTime gap = query.gap.value_or(SimTime{0});
  if (gap == SimTime{0}) return std::nullopt;
  if (gap >= drive.shortest_answer) in_a_row = 0;
  if (gap >= drive.shortest_answer || !reached(in_a_row, kInARow)) return std::nullopt;
  return finding(AdviceKind::kNotWaited, kTooSoon, kInARow, 1000 * ms(gap),
                 1000 * ms(drive.shortest_answer));
}

std::optional<Finding> near_timeout(const DecodedQuery& query, const KnownDrive& drive,
                                    int& pauses) {
  constexpr double kNear = 0.8;  // share of the time-out, from which a pause counts (assumed)
  constexpr double kGone = 3;    // multiple of the time-out: the host was absent (assumed)
  constexpr int kPauses = 3;     // fewer may be accidents (assumed)
  if (!query.gap || !drive.input_window) return std::nullopt;
  const double pause_ms = ms(*query.gap);
  const double window_ms = ms(*drive.input_window);
  if (pause_ms < kNear * window_ms || pause_ms > kGone * window_ms) return std::nullopt;
  if (!reached(pauses, kPauses)) return std::nullopt;
  return finding(AdviceKind::kInputWindow, kPause, pause_ms, window_ms);
}

namespace {

// clang-format off
constexpr BilingualText kTooFar{"a step of {1}° in a stream of targets needs {2} dps; the motor, or a limit, allows {3}",
                        "目标流中有一步为 {1}°，需要 {2} dps；电机或限值只允许 {3}"};
constexpr BilingualText kBehind{"{1} increments in a row; the shaft is {2}° behind them, which is {3} s of them",
                        "连续 {1} 次增量；轴落后 {2}°，相当于 {3} s 的增量"};
// clang-format on

}  // namespace

bool JumpWatch::catches_up(double gap_s) {
  if (gap_s > 2 * mean_gap_s_) {
    delay_s_ = gap_s - mean_gap_s_;
    return false;
  }
  if (delay_s_ > 0 && kTooFast * gap_s < mean_gap_s_) {
    delay_s_ -= mean_gap_s_ - gap_s;
    return true;
  }
  delay_s_ = 0;
  return false;
}

std::optional<Finding> JumpWatch::on_query(const DecodedQuery& query, const KnownDrive& drive) {
  if (!query.motion) return std::nullopt;
  if (!query.motion->absolute()) {
    last_.reset();
    return std::nullopt;
  }
  const Target now{query.at, query.motion->value};
  const std::optional<Target> before = std::exchange(last_, now);
  if (!before || now.at - before->at > kPause) {
    moving_ = 0;
    mean_gap_s_ = 0;
    return std::nullopt;
  }
  const double gap_s = in_seconds(now.at - before->at);
  if (catches_up(gap_s)) return std::nullopt;
  if (now.at - before->at > kStream) {
    moving_ = 0;
    return std::nullopt;
  }
  // Equal times: the simulated clock stood still or slipped, so the real gap is unknown.
  if (now.at == before->at) return std::nullopt;
  const double step_deg = std::abs(now.value_deg - before->value_deg);
  const bool streaming = moving_ == kMoving;
  // Single gaps vary (jitter), so the speed is computed with the longer of gap and mean gap.
  const double pace_s = std::max(mean_gap_s_, gap_s);
  mean_gap_s_ = mean_gap_s_ == 0 ? gap_s : mean_gap_s_ + (gap_s - mean_gap_s_) / kMoving;
  moving_ = step_deg > 0 ? std::min(moving_ + 1, kMoving) : 0;
  const double possible_dps = drive.fastest_dps(query.motion->max_speed_dps);
  if (!streaming || step_deg < kLeast_deg || step_deg <= kTooFast * possible_dps * pace_s) {
    return std::nullopt;
  }
  return finding(AdviceKind::kJump, kTooFar, step_deg, step_deg / pace_s, possible_dps);
}

std::optional<Finding> WindUpWatch::on_query(const DecodedQuery& query, const KnownDrive& drive) {
  if (!query.motion) {
    if (query.is<protocol::Off>() || query.is<protocol::Stop>() ||
        query.is<protocol::ClearAngle>()) {
      run_.reset();  // the command changes the target or the zero of the angle
    }
    return std::nullopt;
  }
  const MotionCommand& motion = *query.motion;
  if (!motion.increment() || motion.value == 0) {
    run_.reset();
    return std::nullopt;
  }
  const bool forward = motion.value > 0;
  if (!run_ || run_->forward != forward || query.at - run_->last > kStream) {
    run_ = Run{.from = query.at, .forward = forward};
  }
  run_->last = query.at;
  ++run_->count;
  run_->commanded_deg += motion.value;
  if (run_->count <= kIncrements || !run_->shaft_from_deg) return std::nullopt;
  const double turned_deg = drive.angle_deg - *run_->shaft_from_deg;
  const double behind_deg = (forward ? 1 : -1) * (run_->commanded_deg - turned_deg);
  const double pace_dps = std::abs(run_->commanded_deg) / in_seconds(query.at - run_->from);
  if (query.at - run_->from < std::chrono::seconds(1) || behind_deg <= kBehind_s * pace_dps) {
    return std::nullopt;
  }
  return finding(AdviceKind::kWindUp, kBehind, run_->count, behind_deg, behind_deg / pace_dps);
}

void WindUpWatch::observe(const KnownDrive& drive) {
  if (run_ && !run_->shaft_from_deg) run_->shaft_from_deg = drive.angle_deg;
}

namespace {

// clang-format off
constexpr BilingualText kIsOff{"the drive is off: the command is answered and not executed",
                       "驱动器已关闭：命令得到回复，但不执行"};
constexpr BilingualText kSwitchOn{"switch the drive on with 0x88, then move",
                          "先用 0x88 运行，然后才发运动命令"};
constexpr BilingualText kHasError{"the drive has an error (errorState {1}): the command is answered and not executed",
                          "驱动器有错误（错误标志 {1}）：命令得到回复，但不执行"};
constexpr BilingualText kClearFirst{"clear the error with 0x9B, switch the drive on with 0x88, then move",
                            "先用 0x9B 清除错误标志，再用 0x88 运行，然后才发运动命令"};
constexpr BilingualText kIgnored{"the drive has had an error (errorState {1}) for {2} s, and the host has not asked for its state",
                         "驱动器出错（错误标志 {1}）已有 {2} s，主机一直没有查询状态"};
constexpr BilingualText kLeft{"the drive has an error (errorState {1}), and the host, which had spoken to it until then, has been silent for 5 s without having asked for its state",
                      "驱动器出错（错误标志 {1}），此前一直与它通信的主机没有查询状态，已沉默 5 s"};
// clang-format on

}  // namespace

std::optional<Finding> TroubleWatch::on_query(const DecodedQuery& query, const Suspect& suspect,
                                              const KnownDrive& drive) {
  if (query.at - last_.at > kPause) traffic_since_ = query.at;
  const bool is_steady = query.at - traffic_since_ >= kUnseen;
  last_ = suspect;
  if (query.is<protocol::Off>() || query.is<protocol::Run>()) off_ = query.is<protocol::Off>();
  if (query.motion) motions_[motion_count_++ % kKept] = {suspect, off_};
  // Another part of the host may send motion commands until it knows that the drive is off.
  if (query.is<protocol::Off>()) quiet_until_ = std::max(quiet_until_, query.at + kReaction);
  const bool asks = query.is<protocol::ReadState1>() || query.is<protocol::ClearErrors>();
  if (asks) asked_ = query.at;
  if (!error_ || !drive.can_be_asked()) return std::nullopt;
  if (asks && !error_->asked) error_->asked = query.at;
  const bool asks_now_and_then = asked_ && query.at - *asked_ <= kUnseen;
  error_->had_steady_traffic = error_->had_steady_traffic || (is_steady && !asks_now_and_then);
  if (asks || query.is<protocol::Off>() || query.is<protocol::Run>()) error_->is_handled = true;
  const SimTime age = query.at - error_->since;
  if (error_->is_handled || age < kUnseen) return std::nullopt;
  if (!reached(error_->queries, kQueries)) return std::nullopt;
  return finding(AdviceKind::kErrorIgnored, kIgnored, drive.errors, in_seconds(age));
}

std::optional<TroubleWatch::Seen> TroubleWatch::observe(SimTime now, std::uint64_t arrived,
                                                        const KnownDrive& drive) {
  const std::uint64_t times = drive.refused_motion - std::exchange(refused_, drive.refused_motion);
  const std::uint64_t before = std::exchange(arrived_, arrived);
  if (!drive.alive) {  // a drive without power has no errors
    error_.reset();
    return std::nullopt;
  }
  if (drive.errors != 0 && !error_) {
    error_ = Error{.since = now, .is_handled = asked_ && now - *asked_ <= kLookedLate};
  }
  const bool tell = times > 0 && motion_count_ > 0 && drive.can_be_asked() && should_report(now);
  if (drive.errors == 0 && error_) {
    error_.reset();
    quiet_until_ = now + kReaction;
  }
  if (!tell) return check_abandoned(now, drive);
  const bool has_error = drive.errors != 0;
  Finding found = has_error ? finding(AdviceKind::kMotionRefused, kHasError, drive.errors)
                            : finding(AdviceKind::kMotionRefused, kIsOff);
  found.todo = has_error ? &kClearFirst : &kSwitchOn;
  return Seen{found, first_of(times, before, arrived), times};
}

std::optional<TroubleWatch::Seen> TroubleWatch::check_abandoned(SimTime now,
                                                                const KnownDrive& drive) {
  const bool is_reported = !error_ || error_->queries == kQueries;
  if (!waits() || is_reported || now - last_.at < kSilence || !drive.can_be_asked()) {
    return std::nullopt;
  }
  error_->had_steady_traffic = false;
  return Seen{finding(AdviceKind::kErrorIgnored, kLeft, drive.errors), last_, 1};
}

bool TroubleWatch::should_report(SimTime now) const {
  if (!error_) return now >= quiet_until_;
  return (error_->asked && now - *error_->asked >= kReaction) || now - error_->since >= kUnseen;
}

const Suspect& TroubleWatch::first_of(std::uint64_t times, std::uint64_t before,
                                      std::uint64_t arrived) const {
  const auto recent = [this](std::size_t n) -> const Motion& {
    return motions_[(motion_count_ - 1 - n) % kKept];
  };
  const std::size_t kept = std::min(motion_count_, kKept);
  std::size_t newest = 0;
  while (newest + 1 < kept && recent(newest).suspect.number > arrived) ++newest;
  std::size_t oldest = newest;
  while (oldest + 1 < kept && recent(oldest + 1).suspect.number > before) ++oldest;
  // If the commands sent while off explain all refusals, the first of these was refused first.
  // Otherwise an error began between the commands, and the last `times` were refused.
  std::uint64_t off = 0;
  std::size_t first_off = oldest;
  for (std::size_t n = newest; n <= oldest; ++n) {
    if (!recent(n).off) continue;
    ++off;
    first_off = n;
  }
  if (off == times) return recent(first_off).suspect;
  return recent(std::min<std::size_t>(newest + times - 1, oldest)).suspect;
}

namespace {

// clang-format off
/// Index: TerminalFlag.
constexpr BilingualText kNotRaw[] = {
    {"ICRNL is set: a 0x0D in a reply arrives as 0x0A, and its sum is wrong", "设着 ICRNL：回复里的 0x0D 到主机变成 0x0A，校验和就不对"},
    {"INLCR is set: a 0x0A in a reply arrives as 0x0D, and its sum is wrong", "设着 INLCR：回复里的 0x0A 到主机变成 0x0D，校验和就不对"},
    {"IGNCR is set: a 0x0D in a reply does not arrive", "设着 IGNCR：回复里的 0x0D 到不了主机"},
    {"ISTRIP is set: bytes of replies lose their highest bit", "设着 ISTRIP：回复的每个字节都丢掉最高位"},
    {"IXON is set: a 0x13 in a reply stops what the host writes, until a 0x11", "设着 IXON：回复里的 0x13 会挡住主机的写，直到出现 0x11"},
    {"OPOST is set: a 0x0A that the host writes has a 0x0D before it on the wire", "设着 OPOST：主机写的 0x0A 在线上前面多一个 0x0D"},
    {"ECHO is set: the terminal sends replies back to the drives", "设着 ECHO：终端把回复又发回给驱动器"},
};
constexpr BilingualText kNoPayload{"0x95 with LEN 0: the drive takes an angle that an earlier packet left in its buffer", "LEN 为 0 的 0x95：驱动器取的是先前的数据包留在缓冲里的角度"};
constexpr BilingualText kPadding{"{command} with LEN 7, which is CAN's", "{command} 的 LEN 为 7，那是 CAN 的长度"};
constexpr BilingualText kOver{"{1} times a packet before the reply to the last was over: this one came {2} µs after it, and the reply ends {3} µs after it at the earliest", "有 {1} 次在上一条的回复结束之前就发：这一条在 {2} µs 之后就来了，而回复最早在 {3} µs 之后结束"};
constexpr BilingualText kEcho{"{1} times a packet right after the host's own bytes came back: {2} µs after the last, whose reply ends {3} µs after it at the earliest", "有 {1} 次读回自己的字节后马上又发：在上一条 {2} µs 之后，而它的回复最早在 {3} µs 之后结束"};
/// Index: rule, as in WrongSums.
constexpr BilingualText kSums[] = {
    {"the header's sum is the remainder of a division by 255", "帧头的校验和取了对 255 的余数"},
    {"the sum of the data is the remainder of a division by 255", "数据的校验和取了对 255 的余数"},
    {"the sum of the data counts the header in", "数据的校验和把帧头也算了进去"},
};
// clang-format on

constexpr std::uint8_t kPadded[] = {0x80, 0x81, 0x88, 0x8C, 0x92, 0x94, 0x9A,
                                    0x9B, 0x9C, 0x9D, 0xA5, 0xA6, 0xA7, 0xA8};
constexpr std::uint8_t kCanDlc = 8;  // command byte and 7 bytes of data, LEN 7

double in_us(SimTime time) { return 1e6 * in_seconds(time); }

unsigned whole_sum(std::span<const std::uint8_t> bytes) {
  unsigned sum = 0;
  for (const std::uint8_t byte : bytes) sum += byte;
  return sum;
}

}  // namespace

Finding not_raw(TerminalFlag flag) {
  return finding(AdviceKind::kTtyNotRaw, kNotRaw[static_cast<std::size_t>(flag)]);
}

std::optional<Finding> wrong_payload(const protocol::Frame& frame, const KnownDrive& drive) {
  const std::uint8_t command = frame.data[0];
  const protocol::Dialect& dialect = drive.format.dialect;
  if (command == static_cast<std::uint8_t>(protocol::ClearAngle::kOpcode)) {
    const bool without = frame.dlc == 1 && dialect.zero_ram_command && dialect.zero_ram_len != 0;
    if (!without) return std::nullopt;
    return finding(AdviceKind::kZeroWithoutPayload, kNoPayload);
  }
  if (frame.dlc != kCanDlc || std::ranges::find(kPadded, command) == std::end(kPadded)) {
    return std::nullopt;
  }
  Finding found = finding(AdviceKind::kCanPadding, kPadding);
  found.command = command;
  return found;
}

SimTime TalkWatch::end_of(const TimedFrame& in) const {
  const auto bytes = static_cast<std::int64_t>(protocol::wire_bytes(in.frame).size);
  return std::max(in.at, own_end_) + bytes * byte_time_;
}

bool TalkWatch::is_queued(const TimedFrame& in) const {
  return in.frame.id == asked_ && end_of(in) <= reply_begins_;
}

std::optional<Finding> TalkWatch::on_query(const TimedFrame& in, bool echoes) {
  if (in.at >= reply_ends_) return std::nullopt;
  const bool has_read_itself = echoes && in.at >= own_end_;
  if (!has_read_itself && is_queued(in)) return std::nullopt;
  int& times = has_read_itself ? after_echo_ : over_;
  if (!reached(times, kTimes)) return std::nullopt;
  return Finding{has_read_itself ? AdviceKind::kEchoTaken : AdviceKind::kTalksOverReply,
                 has_read_itself ? &kEcho : &kOver,
                 {double{kTimes}, in_us(in.at - sent_), in_us(reply_ends_ - sent_)}};
}

void TalkWatch::expect_reply(const TimedFrame& in, const KnownDrive& drive) {
  const bool queued = is_queued(in);
  if (drive.byte_time == SimTime{0}) return;
  if (in.at < reply_ends_ && !queued) return;  // lost: it overlaps with the reply
  const protocol::CommandInfo* const command = protocol::find_command(in.frame.data[0]);
  const std::size_t query = protocol::wire_bytes(in.frame).size;
  std::size_t reply = protocol::kHeaderBytes;
  if (command != nullptr && command->echoed) reply = query;
  if (protocol::has_state(in.frame.data[0])) reply = protocol::kHeaderBytes + kCanDlc;
  const auto more = static_cast<std::int64_t>(query + reply - 2 * protocol::kHeaderBytes);
  sent_ = in.at;
  asked_ = in.frame.id;
  byte_time_ = drive.byte_time;
  own_end_ = end_of(in);
  const SimTime reply_time = static_cast<std::int64_t>(reply) * byte_time_;
  if (queued) {
    reply_ends_ += reply_time;
    return;
  }
  reply_ends_ = in.at + drive.shortest_answer + more * drive.byte_time;
  reply_begins_ = drive.receives_while_replying ? reply_ends_ - reply_time : SimTime{0};
}

std::optional<Finding> wrong_sum(const protocol::Frame& frame, WrongSums& times) {
  constexpr int kTimes = 3;
  const auto bytes = std::span(frame.data).first(frame.dlc);
  if (bytes.size() < protocol::kHeaderBytes || bytes[0] != protocol::kPacketStart) {
    return std::nullopt;
  }
  const std::size_t len = bytes[3];
  if (bytes.size() != protocol::kHeaderBytes + (len > 0 ? len + 1 : 0)) return std::nullopt;
  const unsigned header = whole_sum(bytes.first(protocol::kHeaderBytes - 1));
  const bool good_header = (header & 0xFFU) == bytes[protocol::kHeaderBytes - 1];
  std::optional<std::size_t> rule;
  if (!good_header) {
    if (header % 0xFFU == bytes[protocol::kHeaderBytes - 1]) rule = 0;
  } else if (len > 0) {
    const unsigned data = whole_sum(bytes.subspan(protocol::kHeaderBytes, len));
    const std::uint8_t sum = bytes.back();
    const unsigned all = data + header;
    if (data % 0xFFU == sum) {
      rule = 1;
    } else if ((all & 0xFFU) == sum || ((all + bytes[4]) & 0xFFU) == sum) {
      rule = 2;
    }
  }
  if (!rule) return std::nullopt;
  if (!reached(times[*rule], kTimes)) return std::nullopt;
  return finding(AdviceKind::kSumWrong, kSums[*rule]);
}

}  // namespace lk::emulator
