#include "emulator/monitor/advice/adviser.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "emulator/core/bus/bus.hpp"
#include "emulator/monitor/advice/advice.hpp"
#include "emulator/monitor/advice/bus_watches.hpp"
#include "emulator/monitor/advice/field_watches.hpp"
#include "emulator/monitor/advice/host_watches.hpp"
#include "emulator/monitor/advice/motion_watches.hpp"
#include "emulator/monitor/advice/watch_input.hpp"

namespace lk::emulator {
namespace {

constexpr BilingualText kLength{"{1} of 8 bytes: the drive does not answer",
                                "{1} 个字节，应为 8 个：驱动器不回复"};
constexpr BilingualText kLen{"LEN {1} is not that of the command: the drive does not answer",
                             "LEN {1} 不是该命令的长度：驱动器不回复"};
constexpr BilingualText kNoListener{"no answer, no drive on this bus is in multi-drive mode",
                                    "总线上没有驱动器处于广播模式：无人回复"};
constexpr BilingualText kNotThis{"the frame addresses this drive, whose multi-drive mode is off",
                                 "帧里有给这台驱动器的内容，而它没有打开广播模式"};
constexpr BilingualText kNotAlone{
    "the drive is in multi-drive mode: it answers no frame for one drive",
    "驱动器处于广播模式：不回复单电机命令"};
constexpr BilingualText kUnknownIdentifier{
    "no drive on this bus has this identifier, in either mode",
    "总线上没有驱动器有这个标识符，与模式无关"};
constexpr BilingualText kNotKnown{
    "the drive is in multi-drive mode and does not have this identifier",
    "驱动器处于广播模式，但没有这个标识符"};

constexpr BilingualText kTooMuch{"the drive does not take the query: 16 replies wait in it already",
                                 "驱动器不接受这条命令帧：已有 16 个回复在其中等待"};
constexpr BilingualText kStale{
    "{1} motion commands of an age of up to {2} s were sent from the queue",
    "队列里有 {1} 条运动命令过时才发出，最久的等了 {2} s"};
constexpr BilingualText kTwoHere{"drives {1} and {2} here both answer at ID {3}",
                                 "这里的驱动器 {1} 和 {2} 都以 ID {3} 回复"};
constexpr BilingualText kMoveOne{
    "give one of them another ID with 0x42, save it with 0x44 and restart it, or start with "
    "--wipe-rom",
    "用 0x42 给其中一台换一个 ID，用 0x44 保存后重启，或者用 --wipe-rom 启动"};

/// Returns true if the frame has no slot for drive `id`, or zeros in it.
bool slot_is_empty(const protocol::Frame& frame, int id) {
  const auto slot = static_cast<std::size_t>(id - protocol::kMinId);
  if (slot >= protocol::kMultiDriveSlots) return true;
  return frame.data[2 * slot] == 0 && frame.data[2 * slot + 1] == 0;
}

}  // namespace

class Adviser::Impl {
 public:
  explicit Impl(const BusConfig& config) : serial_(config.serial.has_value()) {
    for (const ServoConfig& servo : config.servos) drives_.emplace_back(KnownDrive(servo, config));
    find_addresses();
  }

  void on_query(const TimedFrame& in) {
    ++query_count_;
    const bool serial = in.frame.kind == protocol::FrameKind::kSerial;
    if (in.frame.kind == protocol::FrameKind::kBytes) {
      return note(kWholeBus, wrong_sum(in.frame, wrong_sums_), in);
    }
    if (serial && !disturbances_.after_slip(in.at)) {
      note(kWholeBus, talk_.on_query(in, echoes_), in);
    }
    if (!serial && (in.frame.kind != protocol::FrameKind::kData || in.frame.extended)) return;
    note(kWholeBus, wire_.on_query(), in);
    if (protocol::find_multi_drive(in.frame.id) != nullptr) return on_multi_drive_query(in);
    const auto id =
        static_cast<std::size_t>(protocol::drive_at(in.frame.id, protocol::kSingleDriveId));
    if (id == 0 || id >= at_address_.size()) {
      recent_.keep(in.frame);
      return;
    }
    if (!disturbances_.writes_stall(in.at)) {
      note(static_cast<int>(id), dead_.on_query(in, static_cast<int>(id)), in);
    }
    if (at_address_[id] < 0) {
      recent_.keep(in.frame);  // may be the reply of a drive outside this emulator
      return;
    }
    note(kWholeBus, two_at(id), in);
    on_single_query(drives_[static_cast<std::size_t>(at_address_[id])], in);
  }

  void on_terminal_flags(const TerminalFlags& flags, const TimedFrame& in) {
    for (const TerminalFlag flag : flags) note(kWholeBus, not_raw(flag), in);
  }

  void on_reply(SimTime at, const protocol::Frame& reply) {
    recent_.keep(reply);
    const auto id = static_cast<std::size_t>(reply.id & 0x3FU);
    const bool readable =
        reply.kind == protocol::FrameKind::kData || reply.kind == protocol::FrameKind::kSerial;
    if (!readable || id == 0 || id >= at_address_.size()) return;
    dead_.on_reply(static_cast<int>(id));
    if (at_address_[id] < 0) return;
    Watched& watched = drives_[static_cast<std::size_t>(at_address_[id])];
    watched.timeout.on_reply();
    watched.answers.on_reply(at, watched.drive);
    // CAN only: on RS-485, what 0x42 writes is in force at once, and is never an ID.
    if (reply.kind == protocol::FrameKind::kData) watched.setting.on_reply(reply.data);
  }

  void observe(const Bus& bus) {
    if (bus.time() < next_observation_) return;
    next_observation_ = bus.time() + kObservePeriod;
    // Also observes one drive in turn, as not only hosts' frames may switch a drive on or off.
    if (!drives_.empty()) {
      Watched& one = drives_[next_drive_++ % drives_.size()];
      one.observations_left = std::max(one.observations_left, 1);
    }
    echoes_ = bus.state().faults.any(&FaultRow::echoes);
    const BusStats stats = bus.stats();
    frames_waiting_ = stats.frames_waiting;
    const std::uint64_t arrived = query_count_ - std::min(stats.frames_waiting, query_count_);
    bool moved = false;
    for (Watched& watched : drives_) {
      const bool waits =
          watched.trouble.waits() || watched.calibration.runs() || watched.unasked.runs();
      if (watched.observations_left == 0 && !waits) continue;
      watched.observations_left = std::max(0, watched.observations_left - 1);
      const int address = watched.drive.address;
      watched.drive.observe(bus);
      moved = moved || watched.drive.address != address;
      if (!watched.drive.multi_drive) watched.unanswerable = 0;
      watched.wind_up.observe(watched.drive);
      watched.unasked.observe(watched.drive, bus.time(), watched.last, advice_);
      if (const auto loaded = watched.calibration.observe(watched.drive)) {
        advice_.note(watched.drive.id, *loaded, watched.last);
      }
      if (const auto seen = watched.trouble.observe(bus.time(), arrived, watched.drive)) {
        advice_.note(watched.drive.id, seen->finding, seen->suspect, seen->times);
      }
    }
    if (moved) find_addresses();
    observe_wire(bus, stats);
  }

  void note_slip(SimTime now) { disturbances_.note_slip(now); }

  std::uint64_t query_count() const { return query_count_; }
  const AdviceLog& advice() const { return advice_; }

 private:
  struct Watched {
    explicit Watched(const KnownDrive& as_configured) : drive(as_configured) {}
    KnownDrive drive;
    int observations_left = kObservations;
    Suspect last;                     // last frame for the drive
    std::uint64_t sent = 0;           // since the last observation
    int unanswerable = 0;             // single-drive frames while in multi-drive mode
    SimTime last_unanswerable_at{0};  // time of the last such frame
    RomWatch rom;
    GenerationWatch generation;
    std::optional<SimTime> last_query_at;
    int not_waited = 0;  // queries in a row that did not wait for the reply
    int pauses = 0;      // pauses near or above the time-out of the lost-input protection
    HostsWatch hosts;
    DuplicateWatch duplicate;
    JumpWatch jump;
    WindUpWatch wind_up;
    SpeedWatch speed;
    TroubleWatch trouble;
    ClearWatch clear;
    UnaskedWatch unasked;
    AnswerWatch answers;
    TimeoutWatch timeout;
    SettingWatch setting;
    CalibrationWatch calibration;
  };

  /// Number of observations after a frame for the drive, which takes time to arrive and act.
  static constexpr int kObservations = 3;
  /// Number of frames until advice: fewer may test which frames are answered. After a longer gap
  /// than kTryAgain, counting starts again.
  static constexpr int kUnanswerableLimit = 10;                  // assumed
  static constexpr SimTime kTryAgain = std::chrono::seconds(1);  // assumed
  /// Frames that a host that waits for replies, and a second one, leave to the wire (assumed).
  static constexpr std::uint64_t kFewWaiting = 4;
  /// One command may have been on the wire when the last drive went away.
  static constexpr std::uint64_t kStaleLimit = 2;
  /// Number of frames until advice: fewer may test for a generation, or be for another device.
  static constexpr int kForeign = 3;  // assumed

  /// Updates at_address_. Of several drives with one ID, it has the first.
  void find_addresses() {
    at_address_.fill(-1);
    for (std::size_t n = drives_.size(); n-- > 0;) {
      at_address_[static_cast<std::size_t>(drives_[n].drive.address)] = static_cast<int>(n);
    }
  }

  /// Finds two drives that both answer at this ID.
  std::optional<Finding> two_at(std::size_t address) const {
    const KnownDrive* first = nullptr;
    for (const Watched& watched : drives_) {
      const KnownDrive& drive = watched.drive;
      const bool answers = drive.alive && drive.on_bus && !drive.multi_drive;
      if (!answers || drive.address != static_cast<int>(address)) continue;
      if (first != nullptr) {
        Finding two = finding(AdviceKind::kDuplicateId, kTwoHere, first->id, drive.id, address);
        two.todo = &kMoveOne;
        return two;
      }
      first = &drive;
    }
    return std::nullopt;
  }

  void on_single_query(Watched& watched, const TimedFrame& in) {
    const KnownDrive& drive = watched.drive;
    watched.observations_left = kObservations;
    watched.last = {query_count_, in.at, in.frame};
    ++watched.sent;
    const bool serial = protocol::is_serial(in.frame);
    if (!serial && in.frame.dlc != 8) return note_length(drive.id, kLength, in.frame.dlc, in);
    for (const Finding& found : watched.setting.on_query(in.frame.data, drive)) {
      note(drive.id, found, in);
    }
    const auto decoded = protocol::decode_query(in.frame, drive.format);
    const auto* query = std::get_if<protocol::Query>(&decoded);
    if (!drive.alive) return;
    if (const auto found = serial ? std::nullopt : watched.duplicate.on_query(in, recent_)) {
      note(drive.id, *found, in);
      return;  // the frame is a reply, not a query of a host
    }
    if (drive.multi_drive) return count_unanswerable(watched, in);
    const auto payload = serial ? wrong_payload(in.frame, drive) : std::nullopt;
    note(drive.id, payload, in);
    if (query == nullptr && std::get<protocol::Reject>(decoded) == protocol::Reject::kWrongLength) {
      // A finding on the payload is more specific.
      if (!payload) note_length(drive.id, kLen, in.frame.dlc - 1, in);
      return;
    }
    if (query == nullptr) return note(drive.id, unknown_command(in.frame, drive), in);
    if (serial) talk_.expect_reply(in, drive);
    on_decoded_query(watched, in, *query);
  }

  /// Counts a single-drive frame to a drive in multi-drive mode, which does not answer it.
  void count_unanswerable(Watched& watched, const TimedFrame& in) {
    if (in.at - watched.last_unanswerable_at > kTryAgain) watched.unanswerable = 0;
    watched.last_unanswerable_at = in.at;
    if (!reached(watched.unanswerable, kUnanswerableLimit)) return;
    note(watched.drive.id, finding(AdviceKind::kSingleInMultiMode, kNotAlone), in);
  }

  /// Returns true if no drive accepts the identifier in any mode; other devices may use it.
  bool is_foreign(const protocol::Frame& frame) const {
    return std::ranges::none_of(drives_, [&frame](const Watched& watched) {
      return protocol::knows_multi_drive(watched.drive.format, frame.id);
    });
  }

  void on_multi_drive_query(const TimedFrame& in) {
    const bool anybody = std::ranges::any_of(
        drives_, [](const Watched& watched) { return watched.drive.multi_drive; });
    if (in.frame.dlc != 8) {
      // Without a drive in multi-drive mode, the frame may be for another device, e.g. CANopen.
      if (anybody) note_length(kWholeBus, kLength, in.frame.dlc, in);
      return;
    }
    if (is_foreign(in.frame) && !anybody) {
      if (reached(foreign_, kForeign) && !drives_.empty()) {
        note(kWholeBus, finding(AdviceKind::kOtherGeneration, kUnknownIdentifier), in);
      }
      return;
    }
    if (!anybody && !drives_.empty()) {
      return note(kWholeBus, finding(AdviceKind::kMultiWithoutMode, kNoListener), in);
    }
    for (Watched& watched : drives_) {
      watched.observations_left = kObservations;
      if (watched.drive.alive) on_slot(watched, in);
    }
  }

  void on_slot(Watched& watched, const TimedFrame& in) {
    const KnownDrive& drive = watched.drive;
    if (!drive.multi_drive || !protocol::knows_multi_drive(drive.format, in.frame.id)) {
      if (slot_is_empty(in.frame, drive.address)) return;
      const Finding found = drive.multi_drive ? finding(AdviceKind::kOtherGeneration, kNotKnown)
                                              : finding(AdviceKind::kMultiWithoutMode, kNotThis);
      return note(drive.id, found, in);
    }
    const auto decoded = protocol::decode_query(in.frame, drive.format);
    const auto* several = std::get_if<protocol::Query>(&decoded);
    if (several == nullptr) return;
    const auto own = protocol::for_drive(drive.address, *several, drive.format);
    const auto* query = std::get_if<protocol::Query>(&own);
    if (query != nullptr) on_decoded_query(watched, in, *query);
  }

  void observe_backlog(const Bus& bus) {
    const StaleCommands& stale = bus.state().host.stale;
    const std::uint64_t before = std::exchange(stale_, stale.count);
    if (stale.count < kStaleLimit || stale.count == before) return;
    Finding found = finding(AdviceKind::kStaleBacklog, kStale, stale.count, in_seconds(stale.age));
    found.replaces_numbers = true;
    advice_.note(kWholeBus, found, {0, bus.time(), stale.frame},
                 stale.count - (stale.count > before ? before : 0));
  }

  void observe_wire(const Bus& bus, const BusStats& stats) {
    observe_backlog(bus);
    disturbances_.observe(bus, stats);
    const bool disturbed = disturbances_.last(bus.time());
    wire_.observe(bus, stats, disturbed);
    Watched* most = nullptr;
    for (Watched& watched : drives_) {
      if (watched.sent > 0 && (most == nullptr || watched.sent > most->sent)) most = &watched;
    }
    if (most != nullptr) busiest_drive_ = static_cast<std::size_t>(most - drives_.data());
    // CAN only: on RS-485 a drive is busy because it replies, and TalkWatch detects that.
    const std::uint64_t busy = stats.count(Reject::kDriveBusy);
    const std::uint64_t rejected = busy - std::exchange(busy_, busy);
    if (rejected > 0 && busiest_drive_ && !serial_ && !disturbed) {
      const Watched& busiest = drives_[*busiest_drive_];
      advice_.note(busiest.drive.id, {AdviceKind::kFasterThanDrive, &kTooMuch}, busiest.last,
                   rejected);
    }
    for (Watched& watched : drives_) watched.sent = 0;
  }

  void on_decoded_query(Watched& watched, const TimedFrame& in, const protocol::Query& query) {
    const auto before = std::exchange(watched.last_query_at, in.at);
    const DecodedQuery decoded{in.at, query.data, query.command,
                               motion_of(query.command, watched.drive.address),
                               before ? std::optional(in.at - *before) : std::nullopt};
    const KnownDrive& drive = watched.drive;
    note(drive.id, beyond_range(decoded, drive), in);
    note(drive.id, watched.generation.on_query(decoded, drive), in);
    note(drive.id, watched.rom.on_query(decoded, drive), in);
    note(drive.id, not_waited(decoded, drive, watched.not_waited), in);
    note(drive.id, near_timeout(decoded, drive, watched.pauses), in);
    note(drive.id, watched.hosts.on_query(decoded), in);
    note(drive.id, watched.jump.on_query(decoded, drive), in);
    note(drive.id, watched.wind_up.on_query(decoded, drive), in);
    note(drive.id, watched.speed.on_query(decoded, drive), in);
    note(drive.id, watched.clear.on_query(decoded, drive), in);
    // In a queue, frames also follow each other before their replies.
    const auto shifted = watched.answers.on_query(decoded.at, drive);
    if (frames_waiting_ < kFewWaiting) note(drive.id, shifted, in);
    watched.unasked.on_query(decoded, {query_count_, in.at, in.frame});
    note(drive.id, watched.timeout.on_query(decoded, drive), in);
    note(drive.id, watched.trouble.on_query(decoded, {query_count_, in.at, in.frame}, drive), in);
  }

  void note_length(int id, const BilingualText& what, double length, const TimedFrame& in) {
    note(id, finding(AdviceKind::kWrongLength, what, length), in);
  }

  void note(int id, const std::optional<Finding>& finding, const TimedFrame& in) {
    if (finding) advice_.note(id, *finding, {query_count_, in.at, in.frame});
  }

  bool serial_;
  std::vector<Watched> drives_;
  std::array<int, protocol::kMaxId + 1> at_address_{};  // −1: no drive answers there
  std::uint64_t query_count_ = 0;
  SimTime next_observation_{0};
  std::size_t next_drive_ = 0;  // drive to observe in turn
  int foreign_ = 0;             // frames for several drives that no drive here accepts
  RecentFrames recent_;
  DeadWatch dead_;
  Disturbances disturbances_;
  WireWatch wire_;
  std::uint64_t frames_waiting_ = 0;  // for the wire, at the last observation
  std::uint64_t stale_ = 0;           // motion commands of a replay, at the last observation
  std::uint64_t busy_ = 0;            // queries so far that a drive rejected as busy
  TalkWatch talk_;
  WrongSums wrong_sums_{};
  bool echoes_ = false;  // a fault lets hosts read back what they send
  std::optional<std::size_t>
      busiest_drive_;  // drive that got most frames before the last observation with frames
  AdviceLog advice_;
};

Adviser::Adviser(const BusConfig& config) : impl_(std::make_unique<Impl>(config)) {}
Adviser::Adviser(Adviser&&) noexcept = default;
Adviser& Adviser::operator=(Adviser&&) noexcept = default;
Adviser::~Adviser() = default;

void Adviser::on_query(const TimedFrame& in) { impl_->on_query(in); }
void Adviser::on_terminal_flags(const TerminalFlags& flags, const TimedFrame& in) {
  impl_->on_terminal_flags(flags, in);
}
void Adviser::on_reply(const TimedFrame& reply) { impl_->on_reply(reply.at, reply.frame); }
void Adviser::note_slip(SimTime now) { impl_->note_slip(now); }
std::uint64_t Adviser::query_count() const { return impl_->query_count(); }
void Adviser::observe(const Bus& bus) { impl_->observe(bus); }
const std::vector<Advice>& Adviser::advice() const { return impl_->advice().all(); }
std::uint64_t Adviser::left_out() const { return impl_->advice().left_out(); }
std::string_view Adviser::mark_of(std::uint64_t number) const {
  return impl_->advice().mark_of(number);
}

}  // namespace lk::emulator
