// Emulated drives of every generation, motor and single switch: the guess includes their true kind,
// for any host frames and any losses in the log.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

#include "emulator/core/generation.hpp"
#include "tests/support/profile.hpp"
#include "tests/tools/guess/guess_support.hpp"
#include "tools/guess/traits.hpp"

namespace lk::emulator {
namespace guess_kinds_test {

using namespace std::chrono_literals;
using test::guessed;
using test::Json;
using test::Logged;
using test::possible_value_names;
using Keys = std::vector<std::string>;

ServoConfig drive(const std::string& motor, Generation generation) {
  ServoConfig config;
  config.profile = test::profile(motor);
  config.rom = config.profile.factory;
  config.generation = generation;
  config.quirks = quirks_of(generation);
  config.boot_angle_deg = 98.1;
  config.flash.write_time = 0ns;
  return config;
}

/// An RS-485 bus with one drive.
BusConfig serial_bus_of(const std::string& motor, Generation generation) {
  ServoConfig servo = drive(motor, generation);
  servo.quirks = quirks_of(generation, protocol::Framing::kSerial);
  BusConfig bus = test::bus_config({}, 1'000'000);
  bus.serial = SerialConfig{};
  bus.servos.push_back(servo);
  return bus;
}

void ask(Logged& log, std::initializer_list<std::string_view> queries) {
  for (const std::string_view data : queries) {
    log.send("141#" + std::string(data) + std::string(16 - data.size(), '0'));
  }
}

/// Polls the state until `wanted`, for at most `most`.
void poll(Logged& log, SimTime most, const std::function<bool()>& wanted) {
  for (SimTime waited{0}; waited < most; waited += 22ms) {
    ask(log, {"9C"});
    if (wanted()) return;
    log.run(20ms);
  }
}

/// Sends all revealing commands several times, with answered ones around them.
void interview(Logged& log) {
  for (int round = 0; round < 3; ++round) {
    ask(log, {"9C", "9A",
              "94", "9C",
              "30", "33",
              "9C", "C00A",
              "9C", "37",
              "9C", "40050A",
              "9C", "8C10",
              "9C", "9D",
              "9C", "9B",
              "A7", "A8",
              "9C", "A1",
              "9C", "A0",
              "9C", "3100646432283232",
              "9C"});
    log.send("141#9100000000000000", 20ms);
    ask(log, {"9C"});
  }
  const double ratio = log.bus().servo(1).config.profile.drive.mechanics.gear_ratio;
  for (int round = 0; round < 3; ++round) {
    ask(log, {"80", "9A", "88"});
    // Far from 0 and from the sent values, also if the drive counts within one turn.
    log.apply({1, TurnShaft{180 / ratio}});
    log.run(100ms);
    ask(log, {"92", "9500000050460000", "92"});
  }
  // 720 dps, stop, and run.
  for (int round = 0; round < 2; ++round) {
    ask(log, {"A200000040190100"});
    poll(log, 600ms, [&log] { return log.speed_dps() > 500; });
    ask(log, {"81"});
    poll(log, 20s, [&log] { return std::abs(log.speed_dps()) <= 2; });
    log.run(500ms);  // it swings in the last cog
    ask(log, {"88"});
    poll(log, 2s, [] { return false; });
  }
  ask(log, {"A200000040190100"});
  poll(log, 600ms, [] { return false; });
}

TEST(GuessKinds, IdentifiesEveryGenerationOfEveryMotor) {
  for (const std::string& motor : test::motor_names()) {
    for (std::size_t n = 0; n < protocol::kGenerationRows.size(); ++n) {
      SCOPED_TRACE(motor + " " + std::string(protocol::kGenerationRows[n].name));
      Logged log(drive(motor, static_cast<Generation>(n)));
      interview(log);
      const Json found = guessed(log.lines())[0];
      EXPECT_EQ(found["fits"], Keys{std::string(protocol::kGenerationRows[n].name)})
          << found.dump(1);
      EXPECT_EQ(found["contradictory"], Json::array());
      EXPECT_EQ(found["odd_currents"], 0);
      const bool ms = log.bus().servo(1).format.series == Series::kMs;
      EXPECT_EQ(possible_value_names(found, "series"), Keys{ms ? "MS" : "MF, MG or MH"});
    }
  }
}

/// Sends CMD and data to drive 1 as packets.
void ask_packets(Logged& log, std::initializer_list<std::string_view> packets) {
  for (const std::string_view data : packets) {
    protocol::Frame frame;
    frame.kind = protocol::FrameKind::kSerial;
    frame.id = protocol::kSingleDriveId + 1;
    frame.dlc = static_cast<std::uint8_t>(data.size() / 2);
    for (std::size_t n = 0; n < frame.dlc; ++n) {
      frame.data[n] =
          static_cast<std::uint8_t>(std::stoi(std::string(data.substr(2 * n, 2)), nullptr, 16));
    }
    log.send(frame, 5ms);
  }
}

/// docs/reference/rs485.md: the presets `legacy` and `late-legacy` differ in scales only, `v236`
/// and `v236b` in 0x07, 0x18 and the reply to 0x19.
TEST(GuessKinds, IdentifiesEveryGenerationOnRs485) {
  const Keys expected[] = {
      {"legacy", "late-legacy"}, {"legacy", "late-legacy"}, {"v235"}, {"v236"}, {"v236b"}};
  for (const std::string& motor : test::motor_names()) {
    for (std::size_t n = 0; n < protocol::kGenerationRows.size(); ++n) {
      SCOPED_TRACE(motor + " " + std::string(protocol::kGenerationRows[n].name));
      const BusConfig bus = serial_bus_of(motor, static_cast<Generation>(n));
      const ServoConfig& servo = bus.servos.front();
      Logged log(bus);
      for (int round = 0; round < 3; ++round) {
        ask_packets(
            log,
            {"9C", "9A",     "9C", "30",   "9C", "33", "9C", "37",     "9C", "C00A000000000000",
             "9C", "409600", "9C", "8C10", "9C", "9D", "9C", "A00000", "9C", "93",
             "9C", "95",     "9C", "12",   "9C", "1F", "9C", "90",     "9C"});
        ask_packets(log,
                    {"9000000000000000", "9C", "19", "9C", "A2000000000000", "9C", "89", "9C"});
      }
      const Json found = guessed(log.lines())[0];
      EXPECT_EQ(found["fits"], expected[n]) << found.dump(1);
      EXPECT_EQ(found["contradictory"], Json::array());
      EXPECT_EQ(found["quirks"], Json::object());
      const bool ms = servo.profile.series == Series::kMs;
      EXPECT_EQ(possible_value_names(found, "series"), Keys{ms ? "MS" : "MF, MG or MH"});
      EXPECT_EQ(found["product"]["motor"], servo.profile.model);
      EXPECT_EQ(found["motor"], motor);
    }
  }
}

/// Each observable switch, and how to configure its values.
struct Flip {
  Trait trait;
  std::function<void(Quirks&, std::size_t)> set;
};
const std::vector<Flip>& flips() {
  using protocol::Dialect;
  static const auto flag = [](bool Dialect::*member) {
    return [member](Quirks& quirks, std::size_t value) {
      quirks.dialect.*member = value == kSwitchedOn;
    };
  };
  static const std::vector<Flip> all{
      {Trait::kReplyId,
       [](Quirks& q, std::size_t v) { q.dialect.reply_id_base = v == 0 ? 0x140 : 0x180; }},
      {Trait::kState1,
       [](Quirks& q, std::size_t v) {
         q.dialect.state_1 = static_cast<protocol::State1Layout>(v);
       }},
      {Trait::kSingleTurn, flag(&Dialect::wide_single_turn)},
      {Trait::kPid, flag(&Dialect::pid_commands)},
      {Trait::kOffset, flag(&Dialect::offset_command)},
      {Trait::kBrake, flag(&Dialect::brake_command)},
      {Trait::kParameters, flag(&Dialect::parameter_commands)},
      {Trait::kMaxTorque, flag(&Dialect::max_torque_commands)},
      {Trait::kSettings, flag(&Dialect::setting_commands)},
      {Trait::kReplyBytes,
       [](Quirks& q, std::size_t v) { q.manual_reply_bytes = v == kSwitchedOn; }},
      {Trait::kClearAngle,
       [](Quirks& q, std::size_t v) {
         q.dialect.clear_angle = static_cast<protocol::ClearAngleMeaning>(v);
       }},
      {Trait::kRunResumes, [](Quirks& q, std::size_t v) { q.run_resumes = v == kSwitchedOn; }},
  };
  return all;
}

TEST(GuessKinds, IdentifiesEverySingleSwitch) {
  for (const std::string& motor : {std::string("mf7015"), std::string("mg4005")}) {
    for (std::size_t n = 0; n < protocol::kGenerationRows.size(); ++n) {
      for (const Flip& flip : flips()) {
        const TraitRow& row = row_of(flip.trait);
        const std::size_t values = flip.trait == Trait::kReplyId ? 2 : row.count;
        for (std::size_t value = 0; value < values; ++value) {
          ServoConfig config = drive(motor, static_cast<Generation>(n));
          if (row.of(config.quirks) == value) continue;
          flip.set(config.quirks, value);
          SCOPED_TRACE(motor + " " + std::string(protocol::kGenerationRows[n].name) + " " +
                       std::string(row.key) + " " + std::string(row.values.at(value)));
          Logged log(config);
          interview(log);
          const auto out = guessed(log.lines());
          EXPECT_EQ(possible_value_names(out[0], row.key), Keys{std::string(row.values.at(value))})
              << out[0].dump(1);
          const Quirks told = test::started(out[1]["commands"][0])[0].servos[0].quirks;
          for (const Flip& other : flips()) {
            EXPECT_EQ(row_of(other.trait).of(told), row_of(other.trait).of(config.quirks))
                << row_of(other.trait).key;
          }
        }
      }
    }
  }
}

/// Sends a trait's probe with its preparation, as described in the trait's row.
void follow(Trait trait, Logged& log) {
  const TraitRow& row = row_of(trait);
  const double ratio = log.bus().servo(1).config.profile.drive.mechanics.gear_ratio;
  if (trait == Trait::kClearAngle) {
    for (const char* const payload : {"9500000050460000", "95000000A08C0000"}) {
      EXPECT_NE(row.how.en.find(payload), std::string_view::npos);
      ask(log, {row.probe, payload, row.probe});
      log.apply({1, TurnShaft{90 / ratio}});
      log.run(100ms);
    }
    return;
  }
  for (int n = 0; n < 3; ++n) ask(log, {row.probe, "9C"});
  if (trait == Trait::kState1) ask(log, {"80", row.probe, "80", row.probe});
}

TEST(GuessKinds, EveryProbeIsConclusive) {
  for (const std::string& motor : {std::string("mf7015"), std::string("ms4010")}) {
    for (std::size_t n = 0; n < protocol::kGenerationRows.size(); ++n) {
      for (std::size_t k = 0; k < kTraitCount; ++k) {
        const auto trait = static_cast<Trait>(k);
        const TraitRow& row = row_of(trait);
        const bool ms = motor == "ms4010";
        if (row.probe.empty() || trait == Trait::kEncoderSpan) continue;  // rotor turns are unseen
        if (trait == Trait::kOpenLoop && !ms) continue;
        SCOPED_TRACE(motor + " " + std::string(protocol::kGenerationRows[n].name) + " " +
                     std::string(row.key));
        const ServoConfig config = drive(motor, static_cast<Generation>(n));
        Logged log(config);
        ask(log, {"9C", "9A", "94", "9C"});
        follow(trait, log);
        const std::size_t value = row.of != nullptr ? row.of(config.quirks) : ms ? kMs : kNotMs;
        const std::string key(trait == Trait::kSeries ? "series" : row.key);
        const Json found = guessed(log.lines())[0];
        EXPECT_EQ(possible_value_names(found, key), Keys{std::string(row.values.at(value))})
            << found.dump(1);
      }
    }
  }
}

/// Errors that only newer drives report: 100 V trip the over-voltage.
TEST(GuessKinds, UsesErrorBitsOfNewerGenerations) {
  ServoConfig config = drive("mf7015", Generation::kV235);
  config.rom.protections[static_cast<std::size_t>(model::Error::kOverVoltage)].enabled = true;
  Logged log(config);
  log.apply({1, SupplyVoltage{100, 0ns}});
  log.run(100ms);
  ask(log, {"9A", "9A"});
  EXPECT_EQ(possible_value_names(guessed(log.lines())[0], "all_error_bits"), Keys{"true"});
}

/// A limit of 50 counts with a load that needs more.
TEST(GuessKinds, UsesCurrentBeyondTheLimit) {
  for (const bool limits : {false, true}) {
    ServoConfig config = drive("mg4005", Generation::kV235);
    config.quirks.dialect.speed_iq_limit = limits;
    Logged log(config);
    ask(log, {"9D"});
    model::LoadParams load;
    load.tau = -2.0;
    log.apply({1, Load{load}});
    for (int n = 0; n < 50; ++n) ask(log, {"A2003200A0860100", "9C"});
    EXPECT_EQ(possible_value_names(guessed(log.lines())[0], "speed_iq_limit"),
              limits ? Keys{} : Keys{"false"});
  }
}

/// Drives in multi-drive mode.
TEST(GuessKinds, UsesMultiDriveCommands) {
  for (const Generation generation : {Generation::kV235, Generation::kV236}) {
    ServoConfig config = drive("mf7015", generation);
    config.rom.broadcast_mode = true;
    Logged log(config);
    for (int n = 0; n < 4; ++n) {
      log.send("280#0100000000000000");
      log.send("281#0100000000000000");
    }
    log.send("280#0100000000000000");
    const Json found = guessed(log.lines())[0];
    const bool newer = generation == Generation::kV236;
    EXPECT_EQ(possible_value_names(found, "multi_drive_more"), Keys{newer ? "true" : "false"})
        << found.dump(1);
  }
}

TEST(WhichDrive, NamesEveryMotorAndGeneration) {
  std::ostringstream page;
  page << std::ifstream(LKEMU_SOURCE_DIR "/docs/start/which-drive.md").rdbuf();
  const std::string text = page.str();
  for (const std::string& motor : test::motor_names()) {
    EXPECT_NE(text.find(test::profile(motor).model), std::string::npos) << motor;
  }
  for (const auto& row : protocol::kGenerationRows) {
    EXPECT_NE(text.find("`" + std::string(row.name) + "`"), std::string::npos) << row.name;
  }
}

/// Returns the word after `option` in a row of the page, or an empty string.
std::string word_after(const std::string& row, const std::string& option) {
  const std::size_t at = row.find(option);
  if (at == std::string::npos) return "";
  const std::size_t begin = at + option.size();
  return row.substr(begin, row.find_first_of(" `,|", begin) - begin);
}

/// Hosts that count 65536 per turn of the rotor or of the output get a matching drive.
TEST(WhichDrive, MatchesTheEncoderSpanOfHosts) {
  std::ifstream page(LKEMU_SOURCE_DIR "/docs/start/which-drive.md");
  int rows = 0;
  for (std::string row; std::getline(page, row);) {
    const bool rotor = row.find("turn of the **rotor**") != std::string::npos;
    const bool output = row.find("turn of the **output**") != std::string::npos;
    const std::string motor = word_after(row, "--motor ");
    if (rotor == output || motor.empty()) continue;
    const std::string given = word_after(row, "--quirk encoder_span=");
    const auto label = label_facts(motor).encoder_span;
    const bool by_motor =
        (label ? *label : test::profile(motor).encoder_span) == EncoderSpan::kRotorTurn;
    EXPECT_EQ(given.empty() ? by_motor : given == "rotor_turn", rotor) << row;
    ++rows;
  }
  EXPECT_EQ(rows, 3);
}

// --- random conversations

/// Random host frames: reads, motion, garbage in unused bytes, repetitions, other traffic.
class RandomHost {
 public:
  explicit RandomHost(std::uint32_t seed) : random_(seed) {}

  int below(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
  protocol::Frame frame() {
    protocol::Frame frame;
    frame.id = protocol::kSingleDriveId + 1;
    frame.data[0] = static_cast<std::uint8_t>(
        protocol::commands()[random_() % protocol::commands().size()].opcode);
    switch (frame.data[0]) {
      case 0x31:
      case 0x32:
        for (std::size_t n = 2; n < 8; ++n)
          frame.data[n] = static_cast<std::uint8_t>(20 + below(60));
        break;
      case 0x34:
        frame.data[1] = static_cast<std::uint8_t>(below(2));  // a type byte for other drives
        frame.data[5] = static_cast<std::uint8_t>(below(64));
        break;
      case 0x8C:
        frame.data[1] = static_cast<std::uint8_t>(below(3) == 2 ? 0x10 : below(2));
        break;
      case 0x91:
        frame.data[6] = frame.data[2] = static_cast<std::uint8_t>(below(256));
        break;
      case 0xC0:
      case 0xC1:
        frame.data[1] = static_cast<std::uint8_t>(below(2) != 0 ? 0x0A : 0x1E);
        frame.data[4] = static_cast<std::uint8_t>(frame.data[0] == 0xC1 ? 30 + below(90) : 0);
        break;
      case 0xA1:
        frame.data[4] = static_cast<std::uint8_t>(below(100));
        break;
      case 0xA2:
        frame.data[2] = static_cast<std::uint8_t>(below(3) == 0 ? 80 + below(100) : 0);
        [[fallthrough]];
      case 0x95:
      case 0xA3:
      case 0xA4:
      case 0xA7:
        frame.data[4] = static_cast<std::uint8_t>(below(256));
        frame.data[5] = static_cast<std::uint8_t>(below(256));
        frame.data[6] = static_cast<std::uint8_t>(below(2));
        break;
      default:
        break;
    }
    return frame;
  }
  SimTime pause() { return below(10) == 0 ? 200ms : std::chrono::microseconds(400 + below(5000)); }

 private:
  std::mt19937 random_;
};

/// Returns a packet to drive 1 with one of the lengths that the manuals give for the command.
protocol::Frame random_packet(RandomHost& host) {
  const auto commands = protocol::serial_commands();
  const auto generations = static_cast<int>(protocol::kGenerationRows.size());
  const auto& command =
      commands[static_cast<std::size_t>(host.below(static_cast<int>(commands.size())))];
  const auto& generation =
      protocol::kGenerationRows.at(static_cast<std::size_t>(host.below(generations)));
  const auto format = protocol::wire_format(generation.serial, Series::kMf);
  protocol::Frame frame;
  frame.kind = protocol::FrameKind::kSerial;
  frame.id = protocol::kSingleDriveId + 1;
  frame.data[0] = static_cast<std::uint8_t>(command.opcode);
  const bool parameter = frame.data[0] == 0xC0 || frame.data[0] == 0xC1;
  const bool setting = frame.data[0] == 0x40 || frame.data[0] == 0x42 || frame.data[0] == 0x44;
  frame.data[1] = static_cast<std::uint8_t>(parameter ? 0x0A : setting ? 0x96 : host.below(2));
  const auto length = protocol::payload_length(command.query, frame.data, format);
  const int len = command.query_len != nullptr ? command.query_len(format)
                  : host.below(2) == 0         ? length.min
                                               : length.max;
  if (len == 0) frame.data[1] = 0;
  for (int n = 2; n <= len && !setting && !parameter; n += 2) {
    frame.data[static_cast<std::size_t>(n)] = static_cast<std::uint8_t>(host.below(60));
  }
  frame.dlc = static_cast<std::uint8_t>(1 + len);
  return frame;
}

TEST(GuessKinds, NeverExcludesTheTrueKindOnRs485) {
  for (const std::string& motor : {std::string("mg4005"), std::string("ms4015")}) {
    for (std::size_t n = 0; n < protocol::kGenerationRows.size(); ++n) {
      for (std::uint32_t seed = 1; seed <= 2; ++seed) {
        const std::string name(protocol::kGenerationRows[n].name);
        SCOPED_TRACE(motor + " " + name + " seed " + std::to_string(seed));
        const BusConfig bus = serial_bus_of(motor, static_cast<Generation>(n));
        Logged log(bus);
        RandomHost host(1000 * seed + static_cast<std::uint32_t>(n));
        for (int k = 0; k < 400; ++k) {
          const auto packet = random_packet(host);
          log.send(packet, 3ms);
          if (host.below(30) == 0) log.send(packet, 3ms);
        }
        Keys lines;
        for (const std::string& line : log.lines()) {
          if (seed == 1 || host.below(50) != 0) lines.push_back(line);
        }
        const Json found = guessed(lines)[0];
        const Keys fits = found["fits"];
        EXPECT_NE(std::ranges::find(fits, name), fits.end()) << found.dump(1);
      }
    }
  }
}

Keys without_stamps(Keys lines) {
  for (std::string& line : lines) {
    const std::string text = line.substr(line.find(')') + 2);  // "vcan0 141#9A…"
    const std::size_t hash = text.find('#');
    std::string shown = text.substr(0, hash) + " [8]";
    for (std::size_t n = hash + 1; n + 1 < text.size(); n += 2) shown += " " + text.substr(n, 2);
    line = shown;
  }
  return lines;
}

TEST(GuessKinds, NeverExcludesTheTrueKind) {
  int undecided = 0;
  int told = 0;
  for (const std::string& motor : test::motor_names()) {
    for (std::size_t n = 0; n < protocol::kGenerationRows.size(); ++n) {
      for (std::uint32_t seed = 1; seed <= 3; ++seed) {
        const std::string name(protocol::kGenerationRows[n].name);
        SCOPED_TRACE(motor + " " + name + " seed " + std::to_string(seed));
        Logged log(drive(motor, static_cast<Generation>(n)));
        RandomHost host(1000 * seed + static_cast<std::uint32_t>(n));
        for (int k = 0; k < 400; ++k) {
          const auto frame = host.frame();
          log.send(frame, host.pause());
          if (host.below(30) == 0) log.send(frame, 400us);  // repetition
          if (host.below(30) == 0) log.send("181#9A19000000000000", 200us);
          if (host.below(100) == 0) log.apply({1, PowerCycle{300ms}});
        }
        const Keys all = log.lines();
        const int lost = seed == 1 ? 0 : seed == 2 ? 100 : 10;  // one in `lost` lines
        Keys lines;
        for (const std::string& line : all) {
          if (lost == 0 || host.below(lost) != 0) lines.push_back(line);
        }
        for (const bool stamped : {true, false}) {
          const Json found = guessed(stamped ? lines : without_stamps(lines))[0];
          const Keys fits = found["fits"];
          EXPECT_NE(std::ranges::find(fits, name), fits.end())
              << (stamped ? "with" : "without") << " stamps\n"
              << found.dump(1);
          ++(fits.size() == 1 ? told : undecided);
        }
      }
    }
  }
  // Such conversations suffice to identify most drives.
  EXPECT_GT(told, 4 * undecided);
}

}  // namespace guess_kinds_test
}  // namespace lk::emulator
