// Replies depend on configuration, seed and frame times only, byte for byte: not on the instants to
// which a caller advances, nor on how far motors lag.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/scenario/sampler.hpp"
#include "tests/emulator/core/core_support.hpp"
#include "tests/support/faults.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace determinism_test {

using namespace std::chrono_literals;

/// Drives of two PWM rates with noise, one of them in multi-drive mode.
BusConfig mixed_config(std::int64_t bitrate, std::uint64_t seed) {
  BusConfig config = test::bus_config({1, 2, 3, 9, 32}, bitrate);
  config.seed = seed;
  for (auto& servo : config.servos) {
    servo.profile.drive.current_sensor.noise = 0.05;
    servo.profile.drive.slow_sensor.v_noise = 0.02;
    servo.profile.drive.encoder.noise = 1e-4;
    servo.boot_angle_deg.reset();
  }
  config.servos[1].profile.drive.inverter.f_pwm = 24000;
  config.servos[3].profile.drive.inverter.f_pwm = 24000;
  config.servos[2].rom.broadcast_mode = true;
  config.servos[4].reply_time = 350us;
  return config;
}

/// Traffic in order of time: sparse, bursts, equal instants, invalid frames, and floods that
/// overflow the queue.
std::vector<TimedFrame> traffic(std::uint32_t seed, int count) {
  std::mt19937 random(seed);
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  std::vector<TimedFrame> frames;
  SimTime at = 0ns;
  for (int k = 0; k < count; ++k) {
    const std::uint32_t pace = below(10);
    at += pace < 4 ? 0ns : pace < 8 ? SimTime(below(300'000)) : SimTime(below(3'000'000));
    TimedFrame in{at, {}};
    constexpr std::array<std::uint32_t, 8> kIds{0x141, 0x142, 0x143, 0x149,
                                                0x160, 0x280, 0x144, 0x7FF};
    in.frame.id = kIds[below(kIds.size())];
    for (auto& byte : std::span(in.frame.data).first(protocol::kCanBytes)) {
      byte = static_cast<std::uint8_t>(below(4) == 0 ? below(256) : 0);
    }
    if (below(20) != 0) {
      in.frame.data[0] = static_cast<std::uint8_t>(protocol::commands()[below(26)].opcode);
    }
    in.frame.dlc = below(50) == 0 ? static_cast<std::uint8_t>(below(8)) : 8;
    in.frame.extended = below(50) == 0;
    in.frame.kind = below(50) == 0 ? protocol::FrameKind::kRemote : protocol::FrameKind::kData;
    frames.push_back(in);
    if (below(300) == 0) frames.insert(frames.end(), 1500, in);
  }
  return frames;
}

struct Outcome {
  std::vector<TimedFrame> replies;
  BusStats stats;
};

constexpr SimTime kSettle = 300ms;  // empties the queues at the end

/// Advances only to the frames.
Outcome run_plainly(Bus bus, const std::vector<TimedFrame>& frames) {
  Outcome run;
  for (const TimedFrame& in : frames) {
    bus.advance_to(in.at);
    bus.receive(in);
  }
  bus.advance_to(frames.back().at + kSettle);
  bus.take_replies(run.replies);
  run.stats = bus.stats();
  return run;
}

/// Advances at random instants in between, sometimes not at all or to the next due time, and takes
/// the replies at random. With `copying` it sometimes continues with a copy of the bus.
Outcome run_split(Bus bus, const std::vector<TimedFrame>& frames, std::uint32_t seed,
                  bool copying) {
  std::mt19937 random(seed);
  Outcome run;
  for (const TimedFrame& in : frames) {
    while (random() % 3 == 0 && bus.time() < in.at) {
      const auto left = static_cast<std::uint32_t>((in.at - bus.time()).count());
      bus.advance_to(bus.time() + SimTime(random() % (left + 1)));
    }
    if (const auto due = bus.next_due(); random() % 4 == 0 && due && *due <= in.at) {
      bus.advance_to(*due);
    }
    if (random() % 5 == 0) bus.take_replies(run.replies);
    if (copying && random() % 50 == 0) {
      Bus copy = bus;
      bus.advance_to(in.at + 5ms);  // the original continues separately
      bus = copy;
    }
    bus.receive(in);
  }
  for (const SimTime end = frames.back().at + kSettle; bus.time() < end;) {
    bus.advance_to(std::min(end, bus.time() + SimTime(random() % 1'000'000)));
  }
  bus.take_replies(run.replies);
  run.stats = bus.stats();
  return run;
}

class Determinism : public ::testing::TestWithParam<std::int64_t> {};

TEST_P(Determinism, SplitsDoNotMatter) {
  const Bus bus(mixed_config(GetParam(), 1));
  const auto frames = traffic(11, 1500);
  const Outcome plain = run_plainly(bus, frames);
  EXPECT_GT(plain.replies.size(), 300U);
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    const Outcome split = run_split(bus, frames, seed, seed % 2 == 0);
    ASSERT_EQ(split.replies, plain.replies);
    // The peak of the queue depends on how far the caller runs ahead with receive().
    BusStats stats = split.stats;
    stats.queue_peak = plain.stats.queue_peak;
    EXPECT_EQ(stats, plain.stats);
  }
}

TEST_P(Determinism, OnlyTheSameSeedGivesTheSameReplies) {
  const auto frames = traffic(12, 500);
  const Outcome first = run_plainly(Bus(mixed_config(GetParam(), 7)), frames);
  const Outcome second = run_plainly(Bus(mixed_config(GetParam(), 7)), frames);
  EXPECT_EQ(first.replies, second.replies);
  EXPECT_EQ(first.stats, second.stats);
  EXPECT_NE(run_plainly(Bus(mixed_config(GetParam(), 8)), frames).replies, first.replies);
  EXPECT_TRUE(std::ranges::is_sorted(first.replies, {}, &TimedFrame::at));
}

INSTANTIATE_TEST_SUITE_P(Bitrates, Determinism, ::testing::Values(0, 250'000, 1'000'000));

// A drive does not depend on other drives: alone on a bus it gives the same bytes.
TEST(Determinism, OtherDrivesDoNotMatter) {
  BusConfig together = mixed_config(0, 5);
  BusConfig alone = together;
  alone.servos = {together.servos[0]};
  const auto frames = traffic(15, 500);
  std::vector<TimedFrame> expected;
  for (const auto& reply : run_plainly(Bus(together), frames).replies) {
    if (reply.frame.id == 0x141) expected.push_back(reply);
  }
  EXPECT_EQ(run_plainly(Bus(alone), frames).replies, expected);
}

constexpr SimTime kEnd = 300ms;
constexpr SimTime kReadPeriod = 7ms + 300us;  // rarely coincides with a tick

/// Twelve drives with noise at three PWM rates, more than a block computes together. Some lose
/// power repeatedly and boot within a millisecond.
BusConfig unsteady_bus(std::int64_t bitrate, bool with_fault) {
  BusConfig config = test::powered_bus({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, bitrate);
  for (ServoConfig& servo : config.servos) {
    servo.profile.drive.logic.boot_time = 0.001;
    servo.profile.drive.encoder.noise = 1e-4;
    servo.profile.drive.current_sensor.noise = 0.05;
    servo.profile.drive.slow_sensor.v_noise = 0.02;
    servo.flash.write_time = 3ms;
    servo.reply_time = 100us * (servo.id % 4);
  }
  config.servos[1].profile.drive.inverter.f_pwm = 20e3;
  config.servos[4].profile.drive.inverter.f_pwm = 24000;
  config.servos[7].profile.drive.inverter.f_pwm = 24000;
  config.servos[10].rom.broadcast_mode = true;
  config.events = {{20ms, {1, SupplyVoltage{2.0, 7ms}}},   {60ms, {1, SupplyVoltage{24.0, 3ms}}},
                   {90ms, {2, TurnShaft{30.0}}},           {100ms, {2, SupplyVoltage{0.0, 0ns}}},
                   {101ms, {2, SupplyVoltage{24.0, 0ns}}}, {120ms, {3, PowerCycle{100ms}}}};
  for (int n = 0; n < 100; ++n) {
    // In pairs, so that of two drives that want to send, one goes first and one may be off.
    const SimTime at = n * 3ms + n % 7 * 130us;
    config.events.push_back({at, {1 + n * 5 % 12, Sag{0.0, 1500us}}});
    if (n % 2 == 0) config.events.push_back({at, {1 + (n * 5 + 1) % 12, Sag{0.0, 900us}}});
  }
  if (with_fault) {
    Fault fault = test::fault_of("drop", {}, {2, 3});
    fault.probability = 0.5;
    fault.duration = 40ms;
    config.events.push_back({120ms, {kWholeBus, SetFault{fault}}});
  }
  std::ranges::stable_sort(config.events, {}, &TimedDirective::at);
  return config;
}

/// Queries, motion, ROM writes, multi-drive commands, and the shortest frames, which show any
/// change in arbitration.
std::vector<TimedFrame> mixed_traffic(std::uint32_t seed, SimTime mean_pause) {
  std::mt19937 random(seed);
  const auto below = [&](std::int64_t n) {
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(random()) % n);
  };
  const char* const kinds[] = {"#9C00000000000000", "#A200000050460000", "#32000A0B0C0D0E0F",
                               "#9200000000000000", "#A400680110270000", "#9D00000000000000"};
  std::vector<TimedFrame> frames;
  SimTime at{0};
  while (at < kEnd) {
    at += SimTime(below(2 * mean_pause.count()));
    protocol::Frame frame = test::frame("141" + std::string(kinds[below(6)]));
    frame.id = 0x141 + below(12);
    const std::uint32_t kind = below(12);
    if (kind == 0) frame.id = 0x280;
    if (kind == 1) frame = {.id = 0x7F0, .kind = protocol::FrameKind::kRemote, .dlc = 0};
    frames.push_back({at, frame});
  }
  return frames;
}

struct Recording {
  std::vector<TimedFrame> replies;
  std::vector<std::uint64_t> rom_writes;
  std::vector<double> states;
  BusStats stats;
  bool operator==(const Recording&) const = default;
};

void record_state(const Bus& bus, std::vector<double>& states) {
  for (int id = 1; id <= 12; ++id) {
    const model::Telemetry telemetry = bus.telemetry(id);
    const model::Truth truth = bus.truth(id);
    states.insert(states.end(), {telemetry.v_bus, telemetry.i_q, telemetry.omega, truth.theta_m,
                                 truth.v_bus, static_cast<double>(telemetry.alive),
                                 static_cast<double>(bus.servo(id).run_state_at(telemetry)),
                                 static_cast<double>(bus.servo(id).ram.acceleration_dps_s)});
  }
  const BusStats stats = bus.stats();
  states.insert(states.end(), {static_cast<double>(stats.replies_lost),
                               static_cast<double>(stats.wire_busy.count()),
                               static_cast<double>(stats.replies_waiting)});
}

/// Sends frames at their times and reads the whole state every kReadPeriod. `advance` advances the
/// bus between these instants.
template <class Advance>
Recording record(const BusConfig& config, const std::vector<TimedFrame>& frames, Advance advance) {
  Bus bus(config);
  Recording out;
  SimTime next_read = kReadPeriod;
  const auto advance_reading_to = [&](SimTime until) {
    for (; next_read <= until; next_read += kReadPeriod) {
      advance(bus, next_read);
      bus.settle();
      record_state(bus, out.states);
    }
    advance(bus, until);
  };
  for (const TimedFrame& in : frames) {
    advance_reading_to(in.at);
    bus.receive(in);
  }
  advance_reading_to(kEnd + 200ms);
  bus.settle();
  record_state(bus, out.states);
  bus.take_replies(out.replies);
  for (const RomWrite& write : test::rom_writes_of(bus)) {
    out.rom_writes.push_back(static_cast<std::uint64_t>(write.id) * 1000 + write.number);
  }
  out.stats = bus.stats();
  return out;
}

struct Case {
  std::int64_t bitrate;
  SimTime mean_pause;
  bool with_fault;
};

class MotorUpdates : public ::testing::TestWithParam<Case> {};

TEST_P(MotorUpdates, LaggingMotorsHaveNoEffect) {
  const auto [bitrate, mean_pause, with_fault] = GetParam();
  const BusConfig config = unsteady_bus(bitrate, with_fault);
  for (std::uint32_t seed = 1; seed <= 2; ++seed) {
    const auto frames = mixed_traffic(seed, mean_pause);
    // The reference: no motor ever lags by a tick.
    const Recording strict = record(config, frames, [](Bus& bus, SimTime until) {
      while (bus.time() < until) bus.advance_to(std::min(until, bus.time() + 10us));
    });
    EXPECT_GT(strict.replies.size(), 50U);
    EXPECT_GT(strict.stats.replies_lost, 0U);
    EXPECT_GT(strict.stats.count(Drop::kNoPower), 0U);
    EXPECT_TRUE(strict ==
                record(config, frames, [](Bus& bus, SimTime until) { bus.advance_to(until); }));
    EXPECT_TRUE(strict ==
                record(config, frames, [](Bus& bus, SimTime until) { bus.deliver_to(until); }));
    std::mt19937 random(seed);
    EXPECT_TRUE(strict == record(config, frames, [&](Bus& bus, SimTime until) {
                  while (bus.time() < until) {
                    const SimTime next = std::min(until, bus.time() + SimTime(random() % 400'000));
                    random() % 4 == 0 ? bus.advance_to(next) : bus.deliver_to(next);
                    if (random() % 16 == 0) bus.settle();
                  }
                }));
  }
}

INSTANTIATE_TEST_SUITE_P(Wires, MotorUpdates,
                         ::testing::Values(Case{0, 1ms, false}, Case{1'000'000, 300us, false},
                                           Case{1'000'000, 120us, true}, Case{50'000, 2ms, false},
                                           Case{50'000, 2500us, true}));

// A directive acts at the bus's time, even if the drive's motor has lagged.
TEST(MotorUpdates, DirectivesActAtTheTimeOfTheBus) {
  Bus settled(test::powered_bus({1, 2}));
  Bus behind = settled;
  for (Bus* bus : {&settled, &behind}) {
    bus->receive({0ns, test::frame("142#A200000050460000")});  // 180 dps
    bus->advance_to(0ns);
  }
  settled.advance_to(200ms);
  behind.deliver_to(200ms);
  for (Bus* bus : {&settled, &behind}) {
    bus->set_load(2, {.J = 0.01});
    bus->power_cycle(2);
    bus->advance_to(250ms);
  }
  EXPECT_GT(settled.truth(2).omega_m, 0.1);
  EXPECT_EQ(behind.truth(2).omega_m, settled.truth(2).omega_m);
  EXPECT_EQ(behind.truth(2).theta_m, settled.truth(2).theta_m);
}

/// Requests a sample every `period`, starting at `period`.
struct Watcher {
  SimTime next_due() const { return next; }
  void sample(const Bus& bus) {
    EXPECT_EQ(bus.time(), next);
    ++samples;
    next += period;
  }
  SimTime period;
  SimTime next = period;
  int samples = 0;
};

TEST(MotorUpdates, EachWatcherSamplesAtItsOwnTimes) {
  Bus bus(test::bus_config({1}));
  Watcher often{3ms};
  Watcher seldom{7ms};
  advance_watched(bus, 30ms, often, seldom);
  EXPECT_EQ(often.samples, 10);
  EXPECT_EQ(seldom.samples, 4);
  EXPECT_EQ(bus.time(), 30ms);
}

// The emulator is a function of time and frames. Its pure rooms must not use clocks, sockets,
// threads, random devices, logs or streams: these tests read their sources. tests/rooms_test.py
// checks their includes.

namespace fs = std::filesystem;

const fs::path kRoot = LKEMU_SOURCE_DIR;

std::vector<fs::path> sources_in(std::initializer_list<const char*> rooms) {
  std::vector<fs::path> files;
  for (const char* room : rooms) {
    for (const fs::path& file : fs::recursive_directory_iterator(kRoot / room)) {
      if (file.extension() == ".hpp" || file.extension() == ".cpp") files.push_back(file);
    }
  }
  return files;
}

/// Returns the lines without comments, which may contain words such as "socket".
std::vector<std::string> code_lines(const fs::path& file) {
  std::ifstream text(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) {
    lines.push_back(line.substr(0, line.find("//")));
  }
  return lines;
}

TEST(Purity, UsesNoClockSocketThreadRandomLogOrStream) {
  constexpr std::array<std::string_view, 29> kForbidden{
      "system_clock",  "steady_clock",  "high_resolution_clock",
      "clock_gettime", "gettimeofday",  "<ctime>",
      "<time.h>",      "time(nullptr)", "sys/socket",
      "linux/can",     "<unistd.h>",    "<boost/",
      "<thread>",      "<mutex>",       "<atomic>",
      "<future>",      "std::async",    "rand(",
      "<random>",      "random_device", "spdlog",
      "<iostream>",    "<fstream>",     "std::cout",
      "std::cerr",     "printf(",       "unordered_map",
      "unordered_set", "getenv"};
  const auto files = sources_in({"protocol", "model", "emulator/core", "emulator/monitor/advice"});
  EXPECT_GT(files.size(), 25U);
  for (const auto& file : files) {
    int number = 0;
    for (const auto& line : code_lines(file)) {
      ++number;
      for (const auto word : kForbidden) {
        EXPECT_EQ(line.find(word), std::string::npos)
            << fs::relative(file, kRoot).string() << ':' << number << ": " << word;
      }
    }
  }
}

TEST(Purity, FoldersOfTheCoreIncludeDownwardsOnly) {
  // Faults act on the wires and nodes of a bus, and the bus applies them: one level.
  const std::vector<std::string> order = {"core", "servo", "bus", "coupling", "scenario"};
  const auto level = [&](const fs::path& file) {
    const std::string folder = file.parent_path().filename().string();
    return std::ranges::find(order, folder == "faults" ? "bus" : folder) - order.begin();
  };
  const std::string begin = "#include \"emulator/core/";
  const auto files = sources_in({"emulator/core"});
  ASSERT_FALSE(files.empty());
  for (const auto& file : files) {
    EXPECT_LT(level(file), std::ssize(order)) << file;
    for (const auto& line : code_lines(file)) {
      if (!line.starts_with(begin)) continue;
      const fs::path included = "core/" + line.substr(begin.size());
      EXPECT_LE(level(included), level(file)) << fs::relative(file, kRoot).string() << ": " << line;
    }
  }
}

}  // namespace determinism_test
}  // namespace lk::emulator
