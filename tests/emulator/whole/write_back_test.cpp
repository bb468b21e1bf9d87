// A tool that reads all parameters of a drive and writes them back changes nothing.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "emulator/core/generation.hpp"
#include "emulator/core/servo/registers.hpp"
#include "tests/support/profile.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace write_back_test {

using namespace std::chrono_literals;
using protocol::Frame;
using protocol::Framing;
using test::Host;

BusConfig bus_of(const std::string& motor, Generation generation, Framing framing) {
  ServoConfig servo;
  servo.id = 1;
  servo.profile = test::profile(motor);
  servo.rom = servo.profile.factory;
  servo.generation = generation;
  servo.quirks = quirks_of(generation, framing);
  servo.flash.write_time = 0ns;
  BusConfig bus = test::bus_config({});
  if (framing == Framing::kSerial) bus.serial = SerialConfig{};
  bus.servos.push_back(servo);
  return bus;
}

/// A read query, and the write commands for its values.
struct Pair {
  Frame read;
  std::vector<std::uint8_t> writes;
};

Frame query(Framing framing, const std::vector<int>& data) {
  Frame frame;
  frame.id = protocol::kSingleDriveId + 1;
  if (framing == Framing::kSerial) {
    frame.kind = protocol::FrameKind::kSerial;
    frame.dlc = static_cast<std::uint8_t>(data.size());
  }
  std::ranges::transform(data, frame.data.begin(),
                         [](int byte) { return static_cast<std::uint8_t>(byte); });
  return frame;
}

/// docs/reference/protocol.md §10 and docs/reference/rs485.md: all parameters that can be read and
/// written.
std::vector<Pair> pairs(Framing framing) {
  std::vector<Pair> all;
  for (const int id : {0x0A, 0x0B, 0x0C, 0x1E, 0x20, 0x22, 0x24, 0x26}) {
    all.push_back({query(framing, {0xC0, id, 0, 0, 0, 0, 0, 0}), {0xC1}});
  }
  all.push_back({query(framing, {0x30}), {0x31, 0x32}});
  all.push_back({query(framing, {0x33}), {0x34}});
  all.push_back({query(framing, {0x37}), {0x38}});
  if (framing == Framing::kSerial) {
    for (int id = 0x96; id <= 0x9E; ++id) {
      all.push_back({query(framing, {0x40, id, 0}), {0x42, 0x44}});
    }
    all.push_back({query(framing, {0x14}), {0x15}});
    return all;
  }
  for (const int item : {0x0A, 0x0B, 0x0C, 0x0D, 0xE0, 0xE2, 0xE4, 0xEA, 0xEC}) {
    all.push_back({query(framing, {0x40, 0x05, item}), {0x42}});
  }
  for (const int table : {0xA0, 0xA4, 0xA8}) {
    all.push_back({query(framing, {0x40, table}), {0x42}});
  }
  return all;
}

/// Returns the reply; none if this drive lacks the command.
std::vector<Frame> ask(Host& host, const Frame& frame) { return host.talk(frame, 1ms); }

/// All stored state of the drive.
struct Kept {
  explicit Kept(const Host& host)
      : ram(host.bus.servo(1).ram),
        rom(host.bus.servo(1).rom),
        pending(pending_rom(host.bus.servo(1))) {}
  Registers ram, rom, pending;
  bool operator==(const Kept&) const = default;
};

/// Reads and writes back; with `lowered` it writes a smaller value in between. Returns the number
/// of values.
int write_back(const BusConfig& config, Framing framing, bool lowered) {
  int values = 0;
  for (const Pair& pair : pairs(framing)) {
    Host host(config);
    const auto read = ask(host, pair.read);
    if (read.empty()) continue;
    for (const std::uint8_t command : pair.writes) {
      SCOPED_TRACE("read " + ::testing::PrintToString(read.front()) + " for " +
                   std::to_string(command));
      ++values;
      const Kept before(host);
      Frame write = read.front();
      write.data[0] = command;
      Frame low = write;
      std::transform(low.data.begin() + 4, low.data.end(), low.data.begin() + 4,
                     [](std::uint8_t byte) { return static_cast<std::uint8_t>(byte / 2); });
      if (lowered) {
        EXPECT_EQ(ask(host, low).size(), 1U);
      }
      EXPECT_EQ(ask(host, write).size(), 1U);
      EXPECT_EQ(ask(host, pair.read), read);
      if (!lowered) {
        EXPECT_EQ(Kept(host), before);
      }
    }
  }
  return values;
}

template <class Act>
void for_every_drive(Act act) {
  for (const std::string& motor : test::motor_names()) {
    for (std::size_t n = 0; n < protocol::kGenerationRows.size(); ++n) {
      for (const Framing framing : {Framing::kCan, Framing::kSerial}) {
        SCOPED_TRACE(motor + " " + std::string(protocol::kGenerationRows[n].name) +
                     (framing == Framing::kCan ? " on CAN" : " on RS-485"));
        act(bus_of(motor, static_cast<Generation>(n), framing), framing);
      }
    }
  }
}

TEST(WriteBack, RestoresEveryFactoryValue) {
  int values = 0;
  for_every_drive([&](const BusConfig& config, Framing framing) {
    values += write_back(config, framing, false);
    write_back(config, framing, true);
  });
  EXPECT_GT(values, 1000);
}

/// Configuration files allow larger values than the manuals let hosts write.
TEST(WriteBack, RestoresTheLargestConfiguredValues) {
  for_every_drive([](BusConfig config, Framing framing) {
    Registers& rom = config.servos.front().rom;
    auto& gains = rom.gains;
    for (std::uint16_t* const gain :
         {&gains.angle_kp, &gains.angle_ki, &gains.angle_kd, &gains.speed_kp, &gains.speed_ki,
          &gains.speed_kd, &gains.current_kp, &gains.current_ki, &gains.current_kd}) {
      *gain = 65535;
    }
    rom.max_torque_current_lsb = config.servos.front().quirks.dialect.iq_command_limit_lsb;
    rom.max_power_permille = 850;
    rom.max_speed_dps = kMaxSpeed_dps - 0.001;  // between two wire values
    rom.max_angle_deg = kMaxAngle_deg - 0.001;
    rom.current_ramp_A_s = kMaxCurrentRamp_A_s - 0.0001;
    rom.acceleration_dps_s = INT32_MAX;
    write_back(config, framing, false);
  });
}

}  // namespace write_back_test
}  // namespace lk::emulator
