#pragma once

/// @file A host on a bus with noiseless, frictionless drives, for tests.

#include <gtest/gtest.h>

#include <chrono>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "protocol/codec.hpp"
#include "tests/support/bus_config.hpp"
#include "tests/support/frames.hpp"

namespace lk::test {

using namespace std::chrono_literals;

/// One host that sends, waits and reads.
class Host {
 public:
  explicit Host(const emulator::BusConfig& config) : bus(config) {}
  explicit Host(const emulator::ServoConfig& servo) : bus(one(servo)) {}

  void wait(emulator::SimTime duration) { bus.advance_to(bus.time() + duration); }

  /// Sends a query; returns the frames received within `window`.
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

  /// Returns the only reply to a query, on a bus where frames take no time.
  protocol::Frame ask(const protocol::Frame& query) {
    const auto replies = talk(query);
    EXPECT_EQ(replies.size(), 1U) << ::testing::PrintToString(query);
    return replies.empty() ? protocol::Frame{} : replies.front();
  }
  protocol::Frame ask(std::string_view query) { return ask(frame(query)); }

  /// Returns the decoded reply to a command for the drive `id`.
  template <class Expected>
  Expected get(const protocol::Command& command, int id = 1) {
    const auto& format = bus.servo(id).format;
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
    return bus.servo(id).run_state_at(bus.telemetry(id));
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
