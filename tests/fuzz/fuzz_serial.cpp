// RS-485 bytes with packets among them, in slices, for two drives.
//
// Input: a byte of settings (`config_from`), then records: a byte whose low two bits select the
// action, and its operands (`Player::play`).

#include <cmath>
#include <numeric>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/generation.hpp"
#include "protocol/serial_framing.hpp"
#include "tests/fuzz/support.hpp"

namespace lk::emulator {
namespace {

using fuzz::Input;
using fuzz::require;

/// Writes in one run: fewer than the hosts' queue holds.
constexpr int kMaxWrites = 100;

BusConfig config_from(std::uint8_t settings) {
  constexpr std::int64_t kRates[] = {0, 115'200, 1'000'000, 4'000'000};
  BusConfig config;
  config.interface = "rs485:fuzz";
  config.bitrate = kRates[settings & 3U];
  config.serial = SerialConfig{};
  config.serial->scan = (settings & 4U) != 0;
  config.serial->max_len = (settings & 8U) != 0 ? 60 : 112;
  for (const int id : {1, 2}) {
    ServoConfig servo;
    servo.id = id;
    servo.generation = static_cast<Generation>(settings >> 4U & 3U);
    servo.quirks = quirks_of(servo.generation, protocol::Framing::kSerial);
    servo.quirks.dialect.lax_length = (settings & 64U) != 0;
    servo.rom.broadcast_mode = (settings & 128U) != 0 && id == 2;
    servo.reply_time = std::chrono::microseconds(150);
    servo.reply_spread = std::chrono::microseconds(50);
    servo.boot_angle_deg = 45;
    config.servos.push_back(servo);
  }
  return config;
}

class Player {
 public:
  Player(const BusConfig& config, bool lazy) : bus_(config), lazy_(lazy) {}

  std::vector<TimedFrame> play(Input input) {
    for (int writes = 0; !input.empty() && writes < kMaxWrites; ++writes) {
      const std::uint8_t what = input.byte();
      switch (what & 3U) {
        case 0:
          now_ += std::chrono::microseconds(input.word());
          if (!lazy_) bus_.advance_to(now_);
          break;
        case 1:
          write_bytes(1U + (what >> 2U), input);
          break;
        case 2:
          write_packet(1 + (what >> 2U & 1U), what >> 3U & 15U, input);
          break;
        default:
          write_broadcast(what >> 2U & 3U, input);
      }
    }
    bus_.advance_to(now_ + std::chrono::seconds(2));
    bus_.take_replies(replies_);
    check_accounts();
    return replies_;
  }

 private:
  void write(const std::vector<std::uint8_t>& bytes) {
    std::vector<protocol::Frame> frames;
    protocol::append_frames(bytes, frames);
    std::size_t size = 0;
    for (const protocol::Frame& frame : frames) {
      size += protocol::wire_bytes(frame).size;
      bus_.receive({now_, frame});
    }
    require(size == bytes.size());
  }

  void write_bytes(std::size_t count, Input& input) {
    std::vector<std::uint8_t> bytes(count);
    for (std::uint8_t& byte : bytes) byte = input.byte();
    write(bytes);
  }

  void write_packet(std::uint32_t id, std::size_t len, Input& input) {
    protocol::Frame frame;
    frame.kind = protocol::FrameKind::kSerial;
    frame.id = protocol::kSingleDriveId + id;
    frame.dlc = static_cast<std::uint8_t>(1 + len);
    for (std::size_t n = 0; n <= len; ++n) frame.data[n] = input.byte();
    const protocol::WireBytes bytes = protocol::wire_bytes(frame);
    require(protocol::packet_at(bytes.view()) == frame);
    write({bytes.view().begin(), bytes.view().end()});
  }

  void write_broadcast(std::size_t command, Input& input) {
    constexpr std::uint32_t kIdentifiers[] = {0x280, 0x281, 0x282, 0x288};
    protocol::Frame frame;
    frame.kind = protocol::FrameKind::kSerial;
    frame.id = kIdentifiers[command];
    for (std::size_t n = 0; n < protocol::kCanBytes; ++n) frame.data[n] = input.byte();
    const protocol::WireBytes bytes = protocol::wire_bytes(frame);
    write({bytes.view().begin(), bytes.view().end()});
  }

  void check_accounts() const {
    const BusStats stats = bus_.stats();
    require(std::accumulate(stats.dropped.begin(), stats.dropped.end(),
                            stats.queries + stats.frames_waiting) == stats.frames);
    std::uint64_t replies = 0;
    for (const int id : {1, 2}) {
      replies += bus_.servo(id).stats.replies;
      const model::Truth truth = bus_.truth(id);
      require(std::isfinite(truth.theta_m) && std::isfinite(truth.omega_out));
    }
    require(replies == stats.replies + stats.replies_lost + stats.replies_waiting);
    require(stats.replies == replies_.size());
  }

  Bus bus_;
  bool lazy_;
  SimTime now_{0};
  std::vector<TimedFrame> replies_;
};

void check(std::span<const std::uint8_t> bytes) {
  Input input(bytes);
  const BusConfig config = config_from(input.byte());
  const auto eager = Player(config, false).play(input);
  const auto lazy = Player(config, true).play(input);
  require(eager == lazy);
}

}  // namespace
}  // namespace lk::emulator

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lk::emulator::check({data, size});
  return 0;
}
