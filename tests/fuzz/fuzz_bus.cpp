// A whole bus with a sequence of frames, interventions and faults. Nothing may crash, every
// accepted query gets its reply, all frames are accounted for, and other time slices give equal
// bytes.
//
// Input: one byte of settings, one of generations when its top bit is set, then records of an
// opcode byte and its operands; see `Player::step`.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/generation.hpp"
#include "tests/fuzz/faults.hpp"
#include "tests/fuzz/support.hpp"

namespace lk::emulator {
namespace {

using fuzz::Input;
using fuzz::require;

constexpr int kMaxSteps = 300;  // keeps one input in the range of milliseconds
constexpr SimTime kAfterwards = std::chrono::milliseconds(50);

constexpr Series kSeries[] = {Series::kMf, Series::kMg, Series::kMh, Series::kMs};

/// Two bits of `generations` for each drive, and the series in the upper two.
BusConfig config_from(std::uint8_t settings, std::uint8_t generations) {
  BusConfig config;
  config.bitrate = (settings & 1U) != 0 ? 1'000'000 : 0;
  for (const int id : {1, 2, 5}) {
    ServoConfig servo;
    servo.id = id;
    const unsigned own = unsigned{generations} >> (2 * config.servos.size()) & 3U;
    servo.generation = static_cast<Generation>(own);
    servo.quirks = quirks_of(servo.generation);
    servo.profile.series = kSeries[generations >> 6U & 3U];
    servo.profile.drive.control.has_current_loop = servo.profile.series != Series::kMs;
    servo.quirks.manual_reply_bytes = (settings & 2U) != 0;
    if ((settings & 4U) != 0) {
      servo.quirks.dialect.clear_angle = protocol::ClearAngleMeaning::kImplemented;
    }
    servo.quirks.stop_holds = (settings & 8U) != 0;
    servo.quirks.run_resumes = (settings & 16U) != 0;
    servo.rom.broadcast_mode = (settings & 32U) != 0 && id != 2;
    servo.rom.max_angle_deg = (settings & 64U) != 0 ? 360 : 0;
    servo.rom.protections[0] = {true, 7.0, 0.5, 0.001};
    servo.profile.drive.supply.i_logic = 0.04;
    config.servos.push_back(servo);
  }
  return config;
}

/// Plays an input on a bus; a lazy player advances time only when needed, or only the wire.
class Player {
 public:
  Player(const BusConfig& config, bool lazy) : bus_(config), lazy_(lazy) {}

  std::vector<TimedFrame> play(Input input) {
    for (int k = 0; k < kMaxSteps && !input.empty(); ++k) {
      step(input);
    }
    bus_.advance_to(now_);
    bus_.apply({kWholeBus, ClearFault{"all"}});
    bus_.advance_to(now_ + kAfterwards);  // most pending events
    bus_.take_replies(replies_);
    check_accounts();
    return replies_;
  }

 private:
  void step(Input& input) {
    const std::uint8_t what = input.byte();
    const int id = (what & 3U) == 0 ? 1 : (what & 3U) == 1 ? 2 : 5;
    switch (what >> 5U) {
      case 0:  // wait: 0..1.3 ms
        wait(input.word());
        break;
      case 1:
        bus_.advance_to(now_);
        bus_.set_supply_voltage(id, 0.25 * input.byte());
        break;
      case 2:
        bus_.advance_to(now_);
        spoil(what >> 2U & 7U, id, input);
        break;
      case 3:
        direct(what >> 2U & 7U, id, input);
        break;
      default:
        receive(what, input);
    }
  }

  void wait(std::uint16_t ticks) {
    now_ += std::chrono::nanoseconds(20 * ticks);
    if (!lazy_) {
      bus_.advance_to(now_);
    } else if (ticks % 2 != 0) {
      bus_.deliver_to(now_);
    }
  }

  void spoil(unsigned kind, int id, Input& input) {
    switch (kind) {
      case 0:
        bus_.power_cycle(id);
        break;
      case 1:
        bus_.apply({kWholeBus, ClearFault{"all"}});
        break;
      case 2: {
        const auto& table = fault_table();
        const FaultRow& row = table[input.byte() % table.size()];
        bus_.apply({kWholeBus, ClearFault{std::string(row.word)}});
        break;
      }
      case 3: {
        const Fault fault = fuzz::fault_from(input, id);
        bus_.plan({now_, {kWholeBus, SetFault{fault}}, fuzz::condition_from(input, id)});
        break;
      }
      case 4:
        bus_.plan({now_ + std::chrono::microseconds(input.word()),
                   {kWholeBus, SetFault{fuzz::fault_from(input, id)}}});
        break;
      case 5:
        bus_.plan({now_, {id, PowerCycle{}}, fuzz::condition_from(input, id)});
        break;
      default:
        bus_.apply({kWholeBus, SetFault{fuzz::fault_from(input, id)}});
    }
  }

  void direct(unsigned kind, int id, Input& input) {
    if (kind == 0) {
      if (!lazy_) {
        bus_.take_replies(replies_);
      }
      return;
    }
    bus_.advance_to(now_);
    const SimTime duration = std::chrono::milliseconds(input.byte());
    const double value = input.byte();
    switch (kind) {
      case 1:
        bus_.apply({id, PowerOff{}});
        break;
      case 2:
        bus_.apply({id, PowerOn{}});
        break;
      case 3:
        bus_.apply({id, PowerCycle{duration}});
        break;
      case 4:
        bus_.apply({id, TurnShaft{4.0 * (value - 128.0)}});
        break;
      case 5:
        bus_.apply({id, Sag{0.25 * value, duration}});
        break;
      case 6:
        bus_.apply({id, SupplyVoltage{0.25 * value, duration}});
        break;
      default:
        bus_.apply({id, Load{{.tau = 0.01 * (value - 128.0),
                              .theta_min = -0.01 * static_cast<double>(
                                                       duration / std::chrono::milliseconds(1)),
                              .theta_max = 0.01 * value}}});
    }
  }

  void receive(std::uint8_t what, Input& input) {
    TimedFrame in{now_, {}};
    const std::uint16_t head = input.word();
    in.frame.id = (what & 4U) != 0 ? head & 0x7FFU : 0x141U + head % 5U;
    if ((what & 24U) == 24U) {
      in.frame.id = protocol::multi_drive_commands()[head % protocol::multi_drive_commands().size()]
                        .identifier;
    }
    if ((what & 8U) != 0) {
      in.frame.kind = static_cast<protocol::FrameKind>(head >> 14U);
      in.frame.extended = (head >> 13U & 1U) != 0;
      in.frame.dlc = static_cast<std::uint8_t>(head >> 9U & 15U);
    }
    for (auto& byte : std::span(in.frame.data).first(protocol::kCanBytes)) {
      byte = input.byte();
    }
    bus_.receive(in);
  }

  void check_accounts() const {
    const BusStats stats = bus_.stats();
    require(std::accumulate(stats.dropped.begin(), stats.dropped.end(),
                            stats.queries + stats.frames_waiting) == stats.frames);
    std::uint64_t replies = 0;
    for (const int id : {1, 2, 5}) {
      require(bus_.servo(id).stats.queries == bus_.servo(id).stats.replies);
      replies += bus_.servo(id).stats.replies;
    }
    require(replies + stats.extra_frames ==
            stats.replies + stats.replies_lost + stats.replies_waiting);
    const auto errors =
        static_cast<std::uint64_t>(std::ranges::count_if(replies_, [](const TimedFrame& one) {
          return one.frame.kind == protocol::FrameKind::kError;
        }));
    require(stats.replies + errors == replies_.size() && stats.error_frames == errors);
    for (const int id : {1, 2, 5}) {
      const model::Truth truth = bus_.truth(id);
      require(std::isfinite(truth.theta_m) && std::isfinite(truth.omega_out) &&
              std::isfinite(truth.i_q) && std::isfinite(truth.v_bus));
    }
  }

  Bus bus_;
  bool lazy_;
  SimTime now_{0};
  std::vector<TimedFrame> replies_;
};

void check(std::span<const std::uint8_t> bytes) {
  Input input(bytes);
  const std::uint8_t settings = input.byte();
  const bool more = (settings & 128U) != 0;
  const BusConfig config = config_from(settings, more ? input.byte() : std::uint8_t{0});
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
