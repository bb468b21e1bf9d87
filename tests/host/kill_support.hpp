#pragma once

/// @file Kills during ROM writes, at any instant: every acknowledged write is stored, and every
/// stored value was written.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <random>
#include <string>
#include <utility>

#include "emulator/config/rom_file.hpp"
#include "tests/host/emulator_process.hpp"
#include "tests/host/host.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::host {
namespace kill {

using Clock = std::chrono::steady_clock;

inline constexpr int kDrives = 3;
inline constexpr int kMaxOnDisk = 6;        // acknowledgements per run before the kill
inline constexpr int kMaxInMemory = 20;     // as above, if writes take no time
inline constexpr double kLongestRest = 2;   // kill delay, in acknowledgement intervals
inline constexpr int kPatienceMs = 60'000;  // for a write that does not end
inline constexpr std::uint32_t kOffsets = 16384;

/// A parameter of a drive, as known to the host that writes it.
struct Parameter {
  std::uint32_t next = 1;             // next value to write; all values are unique
  std::uint32_t acknowledged = 0;     // stored in ROM for certain, or a later one
  std::deque<std::uint32_t> pending;  // written after `acknowledged`
  std::uint64_t acknowledgements = 0;

  std::uint32_t write() {
    pending.push_back(next);
    return next++;
  }
  void acknowledge() {
    ASSERT_FALSE(pending.empty());
    acknowledged = pending.front();
    pending.pop_front();
    ++acknowledgements;
  }
  /// Returns whether a restart may find `value`.
  bool may_be(std::uint32_t value) const {
    return value == acknowledged || std::ranges::find(pending, value) != pending.end();
  }
  void restart(std::uint32_t found) {
    acknowledged = found;
    pending.clear();
  }
};

/// Encodes a value in three bytes of the gains, and again in the other three.
inline Payload write_gains(std::uint32_t value) {
  const auto byte = [value](int shift) { return static_cast<std::uint8_t>(value >> shift); };
  return {0x32, 0, byte(0), byte(8), byte(16), byte(0), byte(8), byte(16)};
}

inline std::uint32_t gains_value(const Payload& pid) {
  EXPECT_TRUE(std::equal(&pid[2], &pid[5], &pid[5])) << "half of one value, half of another";
  return static_cast<std::uint32_t>(pid[2] | pid[3] << 8 | pid[4] << 16);
}

inline Payload write_offset(std::uint32_t value) {
  const std::uint32_t counts = value % kOffsets;
  return {0x91,
          0,
          0,
          0,
          0,
          0,
          static_cast<std::uint8_t>(counts),
          static_cast<std::uint8_t>(counts >> 8)};
}

class Machine {
 public:
  Machine(std::string bus, std::string directory)
      : bus_(std::move(bus)), directory_(std::move(directory)) {}

  /// Starts, checks the stored values, and writes until the kill: after this number of
  /// acknowledgements, plus `rest` intervals between them. The kill therefore hits any phase of a
  /// write, on any machine.
  void live(int acknowledgements_to_see, double rest) {
    StartedEmulator emulator({"--bus", bus_, "--ids", "1-" + std::to_string(kDrives), "--rom",
                              directory_, "--log-level", "off"});
    Host host(bus_);
    for (int id = 1; id <= kDrives; ++id) check(host, id);
    for (int id = 1; id <= kDrives; ++id) {
      send_gains(host, id);
      send_offset(host, id);
    }
    const auto begin = Clock::now();
    for (int i = 0; i < acknowledgements_to_see; ++i) ASSERT_TRUE(take_reply(host, kPatienceMs));
    writing_ += Clock::now() - begin;
    seen_ += acknowledgements_to_see;
    const auto one_write = writing_ / std::max(seen_, 1);
    const auto pause = std::chrono::duration_cast<Clock::duration>(rest * one_write);
    for (const auto end = Clock::now() + pause; Clock::now() < end;) take_reply(host);
    emulator.signal(SIGKILL);
    EXPECT_EQ(emulator.wait().status, 128 + SIGKILL);
    // Replies sent before the kill count as acknowledgements.
    while (take_reply(host, 0)) {
    }
    if (std::ranges::any_of(drives_, [](const Drive& drive) {
          return !drive.gains.pending.empty() || !drive.offset.pending.empty();
        })) {
      ++in_the_midst_;
    }
  }

  std::uint64_t acknowledgements() const {
    std::uint64_t sum = 0;
    for (const auto& drive : drives_) {
      sum += drive.gains.acknowledgements + drive.offset.acknowledgements;
    }
    return sum;
  }
  /// Returns the number of kills during a write.
  int in_the_midst() const { return in_the_midst_; }
  /// Returns the number of restarts that found an unacknowledged value.
  std::uint64_t found_later() const { return found_later_; }

 private:
  struct Drive {
    Parameter gains;
    Parameter offset;
  };

  Drive& drive(int id) { return drives_[static_cast<std::size_t>(id) - 1]; }

  void send_gains(Host& host, int id) {
    host.send(0x140U + static_cast<canid_t>(id), write_gains(drive(id).gains.write()));
  }
  void send_offset(Host& host, int id) {
    host.send(0x140U + static_cast<canid_t>(id), write_offset(drive(id).offset.write()));
  }

  /// Each acknowledgement triggers the next write.
  bool take_reply(Host& host, int patience_ms = 1) {
    const auto reply = host.receive(patience_ms);
    if (!reply) return false;
    const int id = static_cast<int>(reply->can_id) - 0x140;
    const bool is_gains = reply->data[0] == 0x32;
    (is_gains ? drive(id).gains : drive(id).offset).acknowledge();
    if (patience_ms > 0) is_gains ? send_gains(host, id) : send_offset(host, id);
    return true;
  }

  void check(Host& host, int id) {
    const auto pid = host.query(id, {0x30});
    const auto encoder = host.query(id, {0x90});
    ASSERT_TRUE(pid && encoder);
    const std::string file = directory_ + '/' + bus_ + '-' + std::to_string(id) + ".toml";
    if (!std::filesystem::exists(file)) {
      EXPECT_EQ(drive(id).gains.acknowledgements + drive(id).offset.acknowledgements, 0U);
      return;
    }
    emulator::ServoConfig kept;
    kept.id = id;
    kept.profile.name = "mf7015";
    const std::string text = text_of(file);
    ASSERT_NO_THROW(emulator::read_rom(text, file, bus_, kept)) << text;
    compare(drive(id).gains, kept.wear, emulator::RomParameter::kGains, gains_value(*pid),
            static_cast<std::uint32_t>(kept.rom.gains.angle_kp | kept.rom.gains.angle_ki << 8 |
                                       kept.rom.gains.speed_kp << 16));
    compare(drive(id).offset, kept.wear, emulator::RomParameter::kEncoderOffset,
            static_cast<std::uint32_t>((*encoder)[6] | (*encoder)[7] << 8),
            kept.rom.encoder_offset);
  }

  void compare(Parameter& parameter, const emulator::RomWear& wear, emulator::RomParameter which,
               std::uint32_t on_bus, std::uint32_t in_file) {
    const std::uint32_t writes = wear[static_cast<std::size_t>(which)];
    EXPECT_GE(writes, parameter.acknowledgements);
    EXPECT_LT(writes, parameter.next) << "no more than were sent";
    EXPECT_LT(writes, emulator::RomParams{}.endurance) << "or nothing would be proved any more";
    if (writes == 0) return;  // factory value, never written
    EXPECT_EQ(on_bus, in_file);
    EXPECT_TRUE(parameter.may_be(on_bus))
        << on_bus << " is neither " << parameter.acknowledged << " nor one of "
        << parameter.pending.size() << " later ones";
    if (on_bus != parameter.acknowledged) ++found_later_;
    parameter.restart(on_bus);
  }

  std::string bus_;
  std::string directory_;
  std::array<Drive, kDrives> drives_;
  int in_the_midst_ = 0;
  std::uint64_t found_later_ = 0;
  Clock::duration writing_{};  // until the awaited acknowledgements
  int seen_ = 0;               // their number
};

/// Kills runs until `kills` of them hit a write.
inline void until_killed(int kills, const std::string& bus, const std::string& directory,
                         int most_acknowledgements, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> rest(0, kLongestRest);
  std::uniform_int_distribution<int> acknowledgements(0, most_acknowledgements);
  Machine machine(bus, directory);
  while (machine.in_the_midst() < kills && !testing::Test::HasFailure()) {
    const int first = acknowledgements(random);
    machine.live(first, rest(random));
  }
  std::printf("%d kills in the midst of writes: %llu acknowledged, %llu found that were not yet\n",
              machine.in_the_midst(), static_cast<unsigned long long>(machine.acknowledgements()),
              static_cast<unsigned long long>(machine.found_later()));
  EXPECT_GT(machine.acknowledgements(), static_cast<std::uint64_t>(kills));
}

}  // namespace kill
}  // namespace lk::host
