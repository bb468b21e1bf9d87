// 32 drives for a long time under random commands and faults. Counters add up, states are finite,
// memory does not grow, and a seed gives equal bytes each time. A separate program, because it
// counts all allocations. LK_LONG_RUN_S sets the simulated seconds (docs/internals/testing.md).

#include <gtest/gtest.h>
#include <malloc.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <new>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/faults/acts.hpp"
#include "emulator/core/generation.hpp"
#include "tests/emulator/whole/random_life.hpp"
#include "tests/support/profile.hpp"

namespace {
/// Allocated bytes, as malloc counts them.
std::int64_t live_bytes = 0;

void* counted(void* memory) {
  if (memory == nullptr) throw std::bad_alloc();
  live_bytes += static_cast<std::int64_t>(::malloc_usable_size(memory));
  return memory;
}
}  // namespace

void* operator new(std::size_t size) { return counted(std::malloc(size > 0 ? size : 1)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto step = static_cast<std::size_t>(alignment);
  return counted(std::aligned_alloc(step, (size + step) / step * step));
}
void operator delete(void* memory) noexcept {
  live_bytes -= static_cast<std::int64_t>(::malloc_usable_size(memory));  // 0 for a null pointer
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept { operator delete(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { operator delete(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  operator delete(memory);
}

namespace lk::emulator {
namespace {

using namespace std::chrono_literals;

constexpr int kDrives = 32;
constexpr std::int64_t kBitrate = 1'000'000;
constexpr SimTime kEveryday = 3s;
constexpr SimTime kCheck = 10ms;
/// Memory of one more fault in the bus's list, which may have twice the capacity: fault, name,
/// drives with their positions, first effect.
constexpr std::int64_t kBytesOfAFault = 2 * sizeof(LiveFault) + 256;
/// Queues and lists of varying size. They hold at most as many frames as the hosts' send queue,
/// with twice the capacity: for the hosts and, under adapter faults, the adapter. A leak of one
/// frame each would exceed this within a second.
constexpr std::int64_t kMaxBytesOfTheMoment =
    2 * 2 * HostQueue::kDefaultFrames * sizeof(TimedFrame);

/// All delivered motors and all generations in turn.
BusConfig all_motors(std::uint64_t seed) {
  const std::vector<std::string> motors = test::motor_names();
  constexpr std::array kGenerations{Generation::kLegacy, Generation::kLateLegacy, Generation::kV235,
                                    Generation::kV236};
  BusConfig config;
  config.interface = "long";
  config.bitrate = kBitrate;
  config.seed = seed;
  for (int id = 1; id <= kDrives; ++id) {
    const auto n = static_cast<std::size_t>(id);
    ServoConfig servo;
    servo.id = id;
    servo.profile = test::profile(motors[n % motors.size()]);
    servo.generation = kGenerations[n % kGenerations.size()];
    servo.quirks = quirks_of(servo.generation);
    servo.rom = servo.profile.factory;
    servo.rom.broadcast_mode = id <= 2;
    config.servos.push_back(servo);
  }
  return config;
}

class LongRun {
 public:
  LongRun(std::uint32_t seed, SimTime duration)
      : duration_(duration),
        inputs_(seed, kDrives, std::min<SimTime>(duration / 20, 20s)),
        bus_(all_motors(seed)) {
    replies_.reserve(100'000);
    rom_writes_.reserve(1000);
  }

  /// Returns an error message with its time, or an empty string.
  std::string run() {
    for (SimTime at{0}; at < duration_; at += inputs_.up_to(700us)) {
      const int frames = inputs_.one_in(1000) ? inputs_.below(1500) : 1;  // occasionally too many
      for (int n = 0; n < frames; ++n) send(at);
      if (inputs_.one_in(2)) advance(at);
      if (inputs_.one_in(100)) act(at);
      const auto due = static_cast<double>(at.count()) / static_cast<double>(duration_.count());
      if (static_cast<double>(faults_) < due * 0.95 * Bus::kMaxFaults) set_fault();
      if (at < checked_ + kCheck) continue;
      checked_ = at;
      advance(at);
      if (const auto wrong = check()) return *wrong + " at " + std::to_string(at / 1us) + " us";
    }
    return "";
  }

  struct Outcome {
    std::uint64_t hash = 0;  // of every frame from drives, with its time
    BusStats stats;
    std::vector<std::uint64_t> effects;

    friend bool operator==(const Outcome&, const Outcome&) = default;
  };
  Outcome outcome() const {
    Outcome outcome{hash_, bus_.stats(), {}};
    for (const FaultReport& report : bus_.faults()) {
      outcome.effects.push_back(report.evidence.effects);
    }
    return outcome;
  }
  int faults() const { return faults_; }
  std::uint64_t refused_writes() const { return refused_writes_; }

 private:
  void send(SimTime at) {
    const protocol::Frame frame = inputs_.frame();
    bus_.receive({at, frame});
    ++sent_;
    if (frame.id >= protocol::MultiTorque::kIdentifier &&
        frame.id <= protocol::MultiCommand::kIdentifier) {
      for_several_until_ = on_the_wire(bus_.stats(), 0);
    }
  }

  /// Returns the number of host frames sent on the wire so far, with `waiting` still queued.
  std::uint64_t on_the_wire(const BusStats& stats, std::uint64_t waiting) const {
    return sent_ - stats.count(Drop::kErrorFrame) - stats.count(Drop::kCanFd) -
           stats.count(Drop::kQueueFull) - waiting;
  }

  void act(SimTime at) {
    TimedDirective planned{at + inputs_.up_to(5ms), inputs_.directive(), {}, {}};
    if (inputs_.one_in(10)) {
      const int times = 1 + inputs_.below(3);
      planned.when = Condition{inputs_.drive(), CommandSeen{0x9C, times}};
    }
    bus_.plan(planned);
    if (inputs_.one_in(3000)) bus_.apply({kWholeBus, ClearFault{"all"}});
  }

  void set_fault() {
    if (bus_.apply({kWholeBus, SetFault{inputs_.fault()}})) ++faults_;
  }

  void advance(SimTime at) {
    bus_.advance_to(at);
    replies_.clear();
    bus_.take_replies(replies_);
    for (const TimedFrame& reply : replies_) {
      const bool error = reply.frame.kind == protocol::FrameKind::kError;
      ++(error ? seen_errors_ : seen_replies_);
      note(static_cast<std::uint64_t>(reply.at.count()));
      note(reply.frame.id);
      for (const std::uint8_t byte : std::span(reply.frame.data).first(protocol::kCanBytes))
        note(byte);
    }
    rom_writes_.clear();
    bus_.take_rom_writes(rom_writes_);
    for (const RomWrite& write : rom_writes_) {
      if (!inputs_.one_in(20)) continue;  // the disk refuses
      const Servo& servo = bus_.servo(write.id);
      bus_.restore_rom(write.id, servo.rom_before, servo.wear_before);
      ++refused_writes_;
    }
  }

  /// FNV-1a hash.
  void note(std::uint64_t value) {
    for (int n = 0; n < 8; ++n) hash_ = (hash_ ^ (value >> (8 * n) & 0xFFU)) * 0x100000001B3U;
  }

  std::optional<std::string> check() {
    ++checks_;
    if (auto wrong = check_counters()) return wrong;
    if (auto wrong = check_states()) return wrong;
    return check_memory();
  }

  /// Drives with equal IDs reply once each.
  bool share_an_id() const {
    std::set<int> ids;
    for (int id = 1; id <= kDrives; ++id) ids.insert(bus_.bus_address(id).id);
    return ids.size() < kDrives;
  }

  std::optional<std::string> check_counters() {
    const BusStats stats = bus_.stats();
    std::uint64_t dropped = 0;
    for (const std::uint64_t count : stats.dropped) dropped += count;
    std::uint64_t accepted = 0;
    std::uint64_t given = 0;
    for (int id = 1; id <= kDrives; ++id) {
      accepted += bus_.servo(id).stats.queries;
      given += bus_.servo(id).stats.replies;
    }
    if (stats.frames != sent_) return "frames of hosts were lost";
    if (sent_ != stats.queries + dropped + stats.frames_waiting) return "frames do not add up";
    if (accepted != given) return "a query was accepted and not answered";
    if (given + stats.extra_frames != stats.replies + stats.replies_lost + stats.replies_waiting) {
      return "replies do not add up";
    }
    if (stats.replies != seen_replies_) return "replies counted are not those seen";
    if (stats.error_frames != seen_errors_) return "error frames counted are not those seen";
    // Each query has one reply, except those to several drives; without these the difference is
    // constant.
    const std::uint64_t beyond = given - stats.queries;
    const bool none_for_several = for_several_until_ <= on_the_wire_ && !share_an_id();
    if (none_for_several && beyond != beyond_) return "queries and replies do not add up";
    beyond_ = beyond;
    on_the_wire_ = on_the_wire(stats, stats.frames_waiting);
    return {};
  }

  std::optional<std::string> check_states() const {
    for (int id = 1; id <= kDrives; ++id) {
      const DriveView view = bus_.view(id);
      for (const Signal& signal : signals()) {
        if (!std::isfinite(signal.read(view))) {
          return std::string(signal.name) + " of drive " + std::to_string(id) + " is not finite";
        }
      }
    }
    return {};
  }

  std::optional<std::string> check_memory() {
    if (checks_ == 1) bytes_ = live_bytes;  // baseline
    const std::int64_t more = live_bytes - bytes_ - kBytesOfAFault * faults_;
    if (more > kMaxBytesOfTheMoment) return "memory grows by " + std::to_string(more) + " bytes";
    return {};
  }

  SimTime duration_;
  test::RandomInputs inputs_;
  Bus bus_;
  std::vector<TimedFrame> replies_;
  std::vector<RomWrite> rom_writes_;
  SimTime checked_{0};
  std::uint64_t checks_ = 0;
  std::uint64_t sent_ = 0;
  std::uint64_t seen_replies_ = 0;
  std::uint64_t seen_errors_ = 0;
  std::uint64_t for_several_until_ = 0;  // number of the last frame to several drives
  std::uint64_t on_the_wire_ = 0;        // frames sent by the last check
  std::uint64_t beyond_ = 0;             // replies beyond one for each query
  std::uint64_t hash_ = 0xCBF29CE484222325U;
  std::uint64_t refused_writes_ = 0;
  int faults_ = 0;
  std::int64_t bytes_ = 0;
};

LongRun::Outcome checked_run(std::uint32_t seed, SimTime duration) {
  LongRun run(seed, duration);
  EXPECT_EQ(run.run(), "");
  // Checks that every condition of this test has occurred.
  LongRun::Outcome outcome = run.outcome();
  EXPECT_GT(outcome.stats.replies, 1000U);
  EXPECT_GT(outcome.stats.replies_lost, 0U);
  EXPECT_GT(outcome.stats.extra_frames, 0U);
  EXPECT_GT(outcome.stats.error_frames, 0U);
  EXPECT_GT(outcome.stats.count(Drop::kQueueFull), 0U);
  EXPECT_GT(run.refused_writes(), 0U);
  EXPECT_GT(run.faults(), 900);
  return outcome;
}

TEST(LongRun, CountersBalanceStatesStayFiniteAndRunsRepeat) {
  const char* const seconds = std::getenv("LK_LONG_RUN_S");
  if (seconds != nullptr) {
    checked_run(1, std::chrono::seconds(std::stoi(seconds)));
    return;
  }
  const LongRun::Outcome first = checked_run(1, kEveryday);
  EXPECT_EQ(checked_run(1, kEveryday), first);
  EXPECT_NE(checked_run(2, kEveryday).hash, first.hash);
}

}  // namespace
}  // namespace lk::emulator
