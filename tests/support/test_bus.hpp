#pragma once

/// @file A bus with noiseless, frictionless drives, and a host on it, for tests.

#include <gtest/gtest.h>

#include <chrono>
#include <initializer_list>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/generation.hpp"
#include "protocol/codec.hpp"
#include "tests/support/frames.hpp"

namespace lk::test {

using namespace std::chrono_literals;

/// A drive without noise; it boots at 45°, which is 2048 of 16384 counts.
inline emulator::ServoConfig servo_config(int id) {
  emulator::ServoConfig config;
  config.id = id;
  config.profile.name = "test";
  config.profile.drive.current_sensor.noise = 0;
  config.profile.drive.slow_sensor.v_noise = 0;
  config.rom = config.profile.factory;
  config.boot_angle_deg = 45;
  config.flash.write_time = std::chrono::nanoseconds(0);
  return config;
}

/// What one count of its 14-bit encoder is of the reported speed, in 27 periods of 8 kHz; rounded
/// up.
inline constexpr double kSpeedStep_dps = 7;

// LSB of iq from v235 on, by series.
inline constexpr double kMgLsb_A = 66.0 / 4096;
inline constexpr double kMfLsb_A = 33.0 / 4096;

/// The same drive with the firmware of `generation`, of a series.
inline emulator::ServoConfig drive(emulator::Generation generation,
                                   emulator::Series series = emulator::Series::kMg, int id = 1) {
  emulator::ServoConfig config = servo_config(id);
  config.generation = generation;
  config.quirks = emulator::quirks_of(generation);
  config.profile.series = series;
  config.profile.drive.control.has_current_loop = series != emulator::Series::kMs;
  return config;
}

/// Frames take no time unless a bit rate is given.
inline emulator::BusConfig bus_config(std::initializer_list<int> ids, std::int64_t bitrate = 0) {
  emulator::BusConfig config;
  config.interface = "test";
  config.bitrate = bitrate;
  for (const int id : ids) {
    config.servos.push_back(servo_config(id));
  }
  return config;
}

/// A drive whose link is empty 0.45 s after its supply is gone, and that boots in 50 ms.
inline emulator::ServoConfig powered_drive(int id = 1) {
  emulator::ServoConfig config = servo_config(id);
  config.profile.drive.supply.i_logic = 0.04;
  config.profile.drive.logic = {.v_reset = 5.0, .v_reset_hysteresis = 0.5, .boot_time = 0.05};
  return config;
}

inline emulator::BusConfig powered_bus(std::initializer_list<int> ids, std::int64_t bitrate = 0) {
  emulator::BusConfig config = bus_config(ids, bitrate);
  for (emulator::ServoConfig& servo : config.servos) {
    servo = powered_drive(servo.id);
  }
  return config;
}

/// One host that sends, waits and reads.
class Host {
 public:
  explicit Host(const emulator::BusConfig& config) : bus(config) {}
  explicit Host(const emulator::ServoConfig& servo) : bus(one(servo)) {}

  void wait(emulator::SimTime duration) { bus.advance_to(bus.time() + duration); }

  /// What comes back within `window`.
  std::vector<protocol::Frame> talk(const protocol::Frame& query, emulator::SimTime window = 0ns) {
    bus.receive({bus.time(), query});
    wait(window);
    std::vector<emulator::TimedFrame> replies;
    bus.take_replies(replies);
    std::vector<protocol::Frame> frames;
    for (const auto& reply : replies) {
      frames.push_back(reply.frame);
    }
    return frames;
  }

  /// The one reply to a query, on a bus where frames take no time.
  protocol::Frame ask(const protocol::Frame& query) {
    const auto replies = talk(query);
    EXPECT_EQ(replies.size(), 1U) << ::testing::PrintToString(query);
    return replies.empty() ? protocol::Frame{} : replies.front();
  }
  protocol::Frame ask(std::string_view query) { return ask(frame(query)); }

  /// The decoded reply to a command for the drive `id`.
  template <class Expected>
  Expected get(const protocol::Command& command, int id = 1) {
    const auto& format = bus.servo(id).format();
    const auto reply = ask(protocol::encode_query(id, command, format));
    const auto decoded = protocol::decode_reply(reply, format);
    const auto* content = std::get_if<protocol::ReplyFrame>(&decoded);
    if (content == nullptr || !std::holds_alternative<Expected>(content->reply)) {
      ADD_FAILURE() << "unexpected reply " << ::testing::PrintToString(reply);
      return {};
    }
    EXPECT_EQ(content->id, id);
    return std::get<Expected>(content->reply);
  }

  std::int64_t multi_turn_cdeg(int id = 1) {
    return get<protocol::MultiTurnAngle>(protocol::ReadMultiTurnAngle{}, id).angle_cdeg;
  }
  int single_turn_cdeg(int id = 1) {
    const protocol::ReadSingleTurnAngle query;
    return static_cast<int>(get<protocol::SingleTurnAngle>(query, id).angle_cdeg);
  }
  emulator::RunState run_state(int id = 1) const {
    return bus.servo(id).run_state(bus.telemetry(id));
  }
  protocol::State2 state_2(int id = 1) { return get<protocol::State2>(protocol::ReadState2{}, id); }

  emulator::Bus bus;

 private:
  static emulator::BusConfig one(const emulator::ServoConfig& servo) {
    emulator::BusConfig config = bus_config({});
    config.servos.push_back(servo);
    return config;
  }
};

}  // namespace lk::test
