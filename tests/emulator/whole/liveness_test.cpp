// Drives under random faults, on both wires: while no fault is active, every powered drive answers
// a valid query within its reply time. LK_LONG_RUN_S sets the simulated seconds
// (docs/internals/testing.md).

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/generation.hpp"
#include "emulator/core/wire_timing.hpp"
#include "tests/emulator/whole/random_life.hpp"
#include "tests/support/profile.hpp"

namespace lk::emulator {
namespace liveness_test {

using namespace std::chrono_literals;
using protocol::Frame;
using protocol::FrameKind;

constexpr int kDrives = 10;
constexpr SimTime kLongestFault = 30ms;
/// Longest time that a frame remains held after its fault has ended.
constexpr double kLongestHold_ms = 10;
/// Sum of held frames, bus-off recovery, and the pause that resets RS-485 receivers.
constexpr SimTime kSettled = 20ms;
/// Shortest time between two queries.
constexpr SimTime kPeriod = 1ms;

BusConfig ten_drives(std::uint32_t seed, bool serial) {
  constexpr std::array kMotors{"mf7015", "mg4005", "mg6012-i8", "mg5010", "mf9025"};
  constexpr std::array kGenerations{Generation::kLegacy, Generation::kV235, Generation::kV236};
  BusConfig config;
  config.interface = "liveness";
  config.bitrate = serial && seed % 2 == 0 ? 115'200 : 1'000'000;
  config.seed = seed;
  if (serial) config.serial = SerialConfig{};
  for (int id = 1; id <= kDrives; ++id) {
    const auto n = static_cast<std::size_t>(id);
    ServoConfig servo;
    servo.id = id;
    servo.profile = test::profile(kMotors[n % kMotors.size()]);
    servo.generation = kGenerations[n % kGenerations.size()];
    servo.quirks =
        quirks_of(servo.generation, serial ? protocol::Framing::kSerial : protocol::Framing::kCan);
    servo.rom = servo.profile.factory;
    if (serial) {
      servo.reply_time = config.serial->reply_time;
      servo.reply_spread = config.serial->reply_spread;
    }
    config.servos.push_back(servo);
  }
  return config;
}

/// A host that polls the drives in turn while faults come and go.
class PollingHost {
 public:
  PollingHost(std::uint32_t seed, bool serial)
      : serial_(serial),
        inputs_(seed, kDrives, kLongestFault),
        config_(ten_drives(seed, serial)),
        bus_(config_) {}

  /// Returns an error message, or an empty string.
  std::string run(int rounds) {
    for (int n = 0; n < rounds; ++n) {
      begin_faults();
      while (is_faulty()) ask(inputs_.drive());
      if (auto wrong = check_queries(); !wrong.empty()) return wrong;
      if (auto wrong = check_answers(); !wrong.empty()) return wrong;
    }
    return "";
  }
  SimTime time() const { return bus_.time(); }
  int checked() const { return checked_; }

 private:
  void begin_faults() {
    faults_.clear();
    for (int left = 1 + inputs_.below(2); left > 0; --left) {
      Fault fault = inputs_.fault();
      const std::string_view kind = fault.row->word;
      // The effect of such a fault persists: a different ID or different settings.
      if (kind == "id_changed" || kind == "rom_damaged" || kind == "ram_flipped") continue;
      fault.every.reset();
      limit_hold(fault);
      faults_ += " " + std::string(kind);
      ASSERT_TRUE(bus_.apply({kWholeBus, SetFault{fault}}));
    }
  }

  static void limit_hold(Fault& fault) {
    for (std::size_t n = 0; n < fault.row->params.size(); ++n) {
      const std::string_view word = fault.row->params[n].word;
      for (const std::string_view name : {"delay_ms", "jitter_ms", "stall_ms", "recovery_ms"}) {
        if (word == name) fault.values[n] = std::min(fault.values[n].number(), kLongestHold_ms);
      }
      for (const std::string_view name : {"tx_us", "rx_us", "jitter_us", "tail_us", "every_us"}) {
        if (word != name) continue;
        fault.values[n] = std::min(fault.values[n].number(), 1e3 * kLongestHold_ms);
      }
    }
  }

  bool is_faulty() const {
    return std::ranges::any_of(bus_.faults(), [](const FaultReport& report) {
      using enum FaultEvidence::State;
      return report.evidence.state == kActive || report.evidence.state == kArmed;
    });
  }

  Frame query(int id) {
    constexpr std::array<std::uint8_t, 4> kReads{0x9A, 0x9C, 0x92, 0x94};
    Frame frame;
    frame.id = protocol::kSingleDriveId + static_cast<std::uint32_t>(id);
    frame.data[0] = kReads[static_cast<std::size_t>(inputs_.below(kReads.size()))];
    if (serial_) {
      frame.kind = FrameKind::kSerial;
      frame.dlc = 1;
    }
    return frame;
  }

  /// Latest end of the reply.
  SimTime deadline(const Frame& query) const {
    const ServoConfig& servo = config_.servos.front();
    constexpr std::int64_t kLongestReply = 14;
    if (serial_) {
      const auto bytes = static_cast<std::int64_t>(protocol::wire_bytes(query).size);
      return bus_.time() + servo.reply_time + servo.reply_spread +
             bits_duration(kSerialBitsPerByte * (bytes + kLongestReply), config_.bitrate);
    }
    constexpr std::int64_t kLongestFrame_bits = 135;  // eight bytes, with all stuff bits
    return bus_.time() + servo.reply_time + bits_duration(2 * kLongestFrame_bits, config_.bitrate);
  }

  /// Waits for the reply; returns whether it came in time.
  bool ask(int id) {
    const Frame sent = query(id);
    const SimTime last = deadline(sent);
    const SimTime give_up = std::max(last, bus_.time() + kPeriod);
    bus_.receive({bus_.time(), sent});
    std::vector<TimedFrame> replies;
    while (bus_.time() < give_up) {
      bus_.advance_to(std::min(give_up, bus_.time() + 100us));
      bus_.take_replies(replies);
      const bool answered = std::ranges::any_of(replies, [&](const TimedFrame& reply) {
        return reply.frame.kind == (serial_ ? FrameKind::kSerial : FrameKind::kData) &&
               reply.frame.data[0] == sent.data[0] && reply.at <= last && !reply.echo;
      });
      if (answered) return true;
    }
    return false;
  }

  /// A query is not lost while a reply held by a fault is pending.
  std::string check_queries() {
    const BusStats before = bus_.stats();
    for (int id = 1; id <= kDrives; ++id) ask(id);
    const BusStats after = bus_.stats();
    const bool crowded = before.replies_waiting + kDrives > Wire::kDriveQueue;
    if (crowded || after.count(Drop::kDriveBusy) == before.count(Drop::kDriveBusy)) return "";
    return "a drive with a pending reply dropped a query after" + faults_;
  }

  std::string check_answers() {
    SimTime settled = bus_.time() + kSettled;
    for (; bus_.time() < settled; bus_.advance_to(bus_.time() + 1ms)) {
      const BusStats stats = bus_.stats();
      if (stats.frames_waiting + stats.replies_waiting > 0) settled = bus_.time() + kSettled;
    }
    std::vector<TimedFrame> late;
    bus_.take_replies(late);
    for (int id = 1; id <= kDrives; ++id) {
      const std::uint32_t starts = bus_.servo(id).starts;
      const bool was_alive = bus_.telemetry(id).alive;
      ++checked_;
      if (ask(id) || !was_alive) continue;
      if (!bus_.telemetry(id).alive || bus_.servo(id).starts != starts) continue;  // brown-out
      return "drive " + std::to_string(id) + " did not reply after" + faults_;
    }
    return "";
  }

  bool serial_;
  test::RandomInputs inputs_;
  BusConfig config_;
  Bus bus_;
  std::string faults_;
  int checked_ = 0;
};

void expect_replies(bool serial) {
  constexpr int kRounds = 30;  // with two faults each: a bus keeps 1000
  const char* const seconds = std::getenv("LK_LONG_RUN_S");
  const SimTime all = seconds != nullptr ? std::chrono::seconds(std::stoi(seconds)) : SimTime{10s};
  SimTime done{0};
  int checked = 0;
  for (std::uint32_t seed = 1; done < all; ++seed) {
    PollingHost host(seed, serial);
    EXPECT_EQ(host.run(kRounds), "") << "seed " << seed;
    done += host.time();
    checked += host.checked();
  }
  EXPECT_GT(checked, 100);
}

TEST(Liveness, EveryPoweredDriveRepliesAfterAFaultOnCan) { expect_replies(false); }
TEST(Liveness, EveryPoweredDriveRepliesAfterAFaultOnRs485) { expect_replies(true); }

}  // namespace liveness_test
}  // namespace lk::emulator
