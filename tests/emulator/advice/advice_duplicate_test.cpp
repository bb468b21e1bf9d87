// Advice on a second drive with an ID of this bus, and hosts whose frames resemble one.

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "tests/emulator/advice/advice_support.hpp"

namespace lk::emulator {
namespace advice_duplicate_test {

using namespace protocol;

constexpr std::uint64_t kNone = 0;

BusConfig one_bus(const ServoConfig& servo) {
  BusConfig config = test::bus_config({}, 1'000'000);
  config.servos.push_back(servo);
  return config;
}

/// Drive 1 here and another drive with its ID elsewhere, on one wire.
class Rivals {
 public:
  explicit Rivals(const ServoConfig& there) : here(test::servo_config(1)), there_(one_bus(there)) {}

  void say(const Frame& frame) {
    here.send(frame);
    there_.receive({there_.time(), frame});
  }
  void wait(SimTime duration) {
    const SimTime end = here.bus.time() + duration;
    while (here.bus.time() < end) {
      here.wait(50us);
      there_.advance_to(here.bus.time());
      std::vector<TimedFrame> replies;
      here.bus.take_replies(replies);
      for (const TimedFrame& reply : replies) {
        here.adviser.on_reply(reply);
        there_.receive({there_.time(), reply.frame});
      }
      replies.clear();
      there_.take_replies(replies);
      for (const TimedFrame& reply : replies) here.send(reply.frame);
    }
  }

  AdvisedHost here;

 private:
  Bus there_;
};

/// A drive elsewhere, at a higher temperature and with other registers.
ServoConfig other_drive() {
  ServoConfig servo = test::servo_config(1);
  servo.boot_angle_deg = 135;
  servo.profile.drive.thermal.temp_ambient = 35;
  servo.rom.gains.speed_kp = 77;
  servo.rom.acceleration_dps_s = 1234;
  return servo;
}

TEST(DuplicateId, IsReportedWithinAFewFramesOfOneQuery) {
  const std::vector<Command> commands = {ReadState1{},
                                         ClearErrors{},
                                         ReadState2{},
                                         Torque{0.5},
                                         Speed{.speed_dps = 30},
                                         Position1{.target_cdeg = 9000},
                                         Position2{.max_speed_dps = 90, .target_cdeg = 9000},
                                         Position3{},
                                         Position5{.increment_cdeg = 500},
                                         Position6{.max_speed_dps = 90, .increment_cdeg = 500},
                                         ReadPid{},
                                         ReadAcceleration{},
                                         ReadEncoder{},
                                         ReadMultiTurnAngle{},
                                         ReadSingleTurnAngle{}};
  for (const Command& command : commands) {
    Rivals rivals(other_drive());
    rivals.say(query(command));
    rivals.wait(20ms);
    EXPECT_GT(rivals.here.count(AdviceKind::kDuplicateId), kNone) << command.index();
    EXPECT_LT(rivals.here.get(AdviceKind::kDuplicateId).first, 10ms) << command.index();
  }
}

TEST(DuplicateId, IsDetectedBelowZeroCelsius) {
  ServoConfig there = other_drive();
  there.profile.drive.thermal.temp_ambient = -20;
  Rivals rivals(there);
  rivals.say(query(ReadState2{}));
  rivals.wait(20ms);
  EXPECT_GT(rivals.here.count(AdviceKind::kDuplicateId), kNone);
}

/// There is one reply for each query, so a temperature is not taken for a direction.
TEST(DuplicateId, IsDetectedOnDirectedMotionCommands) {
  Rivals rivals(other_drive());
  for (int n = 0; n < 20; ++n) {
    rivals.say(query(Position4{.max_speed_dps = 90, .target_cdeg = 9000}));
    rivals.wait(2ms);
  }
  EXPECT_GT(rivals.here.count(AdviceKind::kDuplicateId), kNone);
}

/// Two programs with equal configurations, which differ only in random values.
TEST(DuplicateId, IsDetectedByNoiseOfIdenticalDrives) {
  ServoConfig twin = test::servo_config(1);
  twin.profile.drive.current_sensor.noise = 0.05;  // A; as in configs/motors/mf7015.toml
  Rivals rivals(twin);
  rivals.say(query(ReadState2{}));
  rivals.wait(1s);
  EXPECT_GT(rivals.here.count(AdviceKind::kDuplicateId), kNone);
}

/// Such an echo could also be a host that sends without a pause.
TEST(DuplicateId, IsNotReportedForEchoesAlone) {
  Rivals rivals(other_drive());
  rivals.say(query(protocol::Run{}));
  rivals.wait(20ms);
  EXPECT_EQ(rivals.here.count(AdviceKind::kDuplicateId), kNone);
  rivals.say(query(ReadState2{}));
  rivals.wait(500ms);
  EXPECT_GT(rivals.here.count(AdviceKind::kDuplicateId), kNone);
  // A frame of another drive is not judged as a host's.
  EXPECT_EQ(rivals.here.adviser.advice().size(), 1U) << rivals.here.all();
}

/// Their IDs in ROM are equal, or were set equal by 0x42 (docs/reference/protocol.md §10.9).
TEST(DuplicateId, IsReportedForTwoDrivesOnOneBus) {
  BusConfig config = test::bus_config({}, 1'000'000);
  config.servos = {test::drive(Generation::kV236b, Series::kMg, 1),
                   test::drive(Generation::kV236b, Series::kMg, 7)};
  config.servos[1].rom.driver_id = 1;
  config.servos[1].profile.drive.supply.i_logic = 0.05;  // A; empties the link
  AnsweredHost host(config);
  host.repeat(1, 5ms, "147#9C00000000000000");
  EXPECT_EQ(host.count(AdviceKind::kDuplicateId, 0), kNone);
  host.send("141#9C00000000000000");
  ASSERT_EQ(host.count(AdviceKind::kDuplicateId, 0), 1U) << host.all();
  EXPECT_EQ(host.what(AdviceKind::kDuplicateId, 0), "drives 1 and 7 here both answer at ID 1");
  host.bus.apply({7, PowerOff{}});
  host.wait(1s);
  host.send("141#9C00000000000000");
  EXPECT_EQ(host.count(AdviceKind::kDuplicateId, 0), 1U) << "one of them is off";
}

// --- hosts

constexpr std::uint8_t kRead = 0x9C;
constexpr std::uint8_t kTorqueByte = 0xA1;

/// Hosts on a bus with drives 1 to 4, and the replies.
class Hosts : public testing::Test {
 protected:
  /// Returns the last reply within 0.5 ms; zeros if there is none.
  protocol::Payload ask(const protocol::Payload& data, std::uint32_t id = 0x141) {
    here.send(Frame{.id = id, .dlc = 8, .data = data});
    here.wait(500us);
    return replies();
  }
  protocol::Payload replies() {
    std::vector<TimedFrame> taken;
    here.bus.take_replies(taken);
    for (const TimedFrame& reply : taken) here.adviser.on_reply(reply);
    return taken.empty() ? protocol::Payload{} : taken.back().frame.data;
  }
  void expect_nothing() const {
    for (int id = 1; id <= 4; ++id) {
      EXPECT_EQ(here.count(AdviceKind::kDuplicateId, id), kNone) << here.all();
    }
  }

  static BusConfig noisy() {
    BusConfig config = test::bus_config({1, 2, 3, 4}, 1'000'000);
    for (ServoConfig& servo : config.servos) servo.profile.drive.current_sensor.noise = 0.1;
    return config;
  }
  AdvisedHost here{noisy()};
};

TEST_F(Hosts, TwoWithZeroedFramesAreNotDuplicateDrives) {
  for (std::uint8_t n = 0; n < 250; ++n) {
    ask({kRead});
    ask({kRead});
    ask({kTorqueByte, 0, 0, 0, n});
    ask({kTorqueByte, 0, 0, 0, static_cast<std::uint8_t>(250 - n)});
    ask({0xA6, static_cast<std::uint8_t>(n % 2), 100, 0, 0x10, 0x27});
  }
  expect_nothing();
}

TEST_F(Hosts, ReusedReceiveBufferIsNotADuplicateDrive) {
  for (const std::uint8_t command :
       std::to_array<std::uint8_t>({0x30, 0x33, 0x90, 0x92, 0x94, 0x9A, 0x9B, 0x9C, 0x9D, 0xA1,
                                    0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8})) {
    protocol::Payload buffer{command};
    for (std::uint8_t n = 0; n < 100; ++n) {
      if (command > 0xA0) buffer[4] = n;
      buffer = ask(buffer);
      buffer[0] = command;
    }
  }
  expect_nothing();
}

TEST_F(Hosts, BufferReusedForSeveralDrivesIsNotADuplicateDrive) {
  protocol::Payload buffer{kRead};
  for (int n = 0; n < 500; ++n) {
    for (const std::uint32_t id : {0x141U, 0x142U, 0x143U, 0x144U}) {
      here.send(Frame{.id = id, .dlc = 8, .data = buffer});
    }
    here.wait(2ms);
    buffer = replies();
    ASSERT_EQ(buffer[0], kRead);
  }
  expect_nothing();
}

TEST_F(Hosts, DataInUnusedBytesIsNotADuplicateDrive) {
  for (std::uint8_t n = 0; n < 250; ++n) {
    ask({kRead, 30, n, n, n, n, n, n});
    ask({kTorqueByte, 30, 1, 2, n, 0, 3, 4});
  }
  expect_nothing();
}

TEST_F(Hosts, PaddingWith0xFFIsNotADuplicateDrive) {
  for (std::uint8_t n = 0; n < 250; ++n) {
    ask({kTorqueByte, 0, 0, 0, n});
    ask({kTorqueByte, 0xFF, 0xFF, 0xFF, n, 0, 0xFF, 0xFF});
  }
  expect_nothing();
}

TEST_F(Hosts, RandomUnusedBytesAreNotADuplicateDrive) {
  std::uint32_t random = 1;
  for (const std::uint8_t command : std::to_array<std::uint8_t>({kRead, 0x33, 0x90, 0x92, 0x94})) {
    ask({command});
    for (int n = 0; n < 5000; ++n) {
      protocol::Payload data{command};
      for (std::size_t k = 1; k < 8; ++k) {
        data[k] = static_cast<std::uint8_t>((random = random * 1664525 + 1013904223) >> 24U);
      }
      ask(data);
    }
  }
  expect_nothing();
}

/// One host clears its frames; the other sends data 200 times a second.
TEST_F(Hosts, TwoWithDifferentPaddingAreNotDuplicateDrives) {
  for (std::uint8_t n = 0; n < 250; ++n) {
    ask({kRead});
    ask({kRead, 30, 1, 2, 3, 4, 5, 6});
    here.wait(4ms);
  }
  expect_nothing();
}

TEST_F(Hosts, UnknownDirectionByteIsNotADuplicateDrive) {
  for (const std::uint8_t command : std::to_array<std::uint8_t>({0xA5, 0xA6})) {
    ask({command, 0, 0x68, 0x01, 0x50, 0x46});
    for (int n = 0; n < 20; ++n) ask({command, 2, 0x68, 0x01, 0x50, 0x46});
    for (int n = 0; n < 20; ++n) {  // forwards and backwards
      ask({command, 0, 0x68, 0x01, 0x50, 0x46});
      ask({command, 2, 0x68, 0x01, 0x28, 0x23});
    }
    for (std::uint8_t n = 0; n < 20; ++n) ask({command, 2, 0x68, n, 0x50, n});
    for (int n = 0; n < 20; ++n) ask({command, 2, 0x68, 0x01, 0xB0, 0xB9, 0xFF, 0xFF});
  }
  expect_nothing();
}

TEST_F(Hosts, DriveElsewhereWithAnotherIdIsNotADuplicate) {
  for (std::uint8_t n = 0; n < 250; ++n) {
    ask({kRead}, 0x147);
    ask({kRead, 30, n, 2, 3, 4, 5, n}, 0x147);
    ask({kRead});
  }
  expect_nothing();
}

}  // namespace advice_duplicate_test
}  // namespace lk::emulator
