#pragma once

/// Feeds logs of known drives, in candump's format, to the guesser and returns its output.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/config/candump_log.hpp"
#include "protocol/wire.hpp"
#include "tests/support/profile.hpp"
#include "tests/support/test_bus.hpp"
#include "tests/tools/reader_output.hpp"
#include "tools/commands/cli.hpp"
#include "tools/guess/guesser.hpp"

namespace lk::test {

using Json = nlohmann::json;

/// A host with emulated drives, while candump logs the bus.
class Logged {
 public:
  explicit Logged(const emulator::BusConfig& config) : bus_(config) {}
  explicit Logged(const emulator::ServoConfig& servo) : bus_(one(servo)) {}

  /// Sends a query and logs the frames until `wait` is over.
  void send(const protocol::Frame& query, emulator::SimTime wait = 2ms) {
    bus_.receive({bus_.time(), query});
    log_.push_back({bus_.time(), query});
    run(wait);
  }
  void send(std::string_view query, emulator::SimTime wait = 2ms) { send(frame(query), wait); }
  void run(emulator::SimTime time) {
    bus_.advance_to(bus_.time() + time);
    bus_.take_replies(log_);
  }
  /// Returns the speed in the last state 2.
  int speed_dps() const {
    for (auto one = log_.rbegin(); one != log_.rend(); ++one) {
      const auto& data = one->frame.data;
      if (data[0] == 0x9C && data[1] > 1) return protocol::get_le<std::int16_t>(data, 4);
    }
    return 0;
  }
  void apply(const emulator::Directive& directive) { bus_.apply(directive); }
  emulator::Bus& bus() { return bus_; }

  std::vector<std::string> lines() {
    std::ranges::stable_sort(log_, {}, &emulator::TimedFrame::at);
    std::vector<std::string> lines;
    for (const auto& one : log_)
      lines.push_back(emulator::candump_line(one.at, "vcan0", one.frame));
    return lines;
  }

 private:
  static emulator::BusConfig one(const emulator::ServoConfig& servo) {
    emulator::BusConfig config = bus_config({}, 1'000'000);
    config.servos.push_back(servo);
    config.always_acknowledged = true;  // frames leave in the order of the log
    return config;
  }

  emulator::Bus bus_;
  std::vector<emulator::TimedFrame> log_;
};

/// Returns the motor whose file has this label.
inline std::string motor_sold_as(const std::string& label) {
  for (const std::string& name : motor_names()) {
    if (profile(name).model == label) return name;
  }
  return "";
}

inline std::string guessed_text(const std::vector<std::string>& lines,
                                emulator::Language language = emulator::Language::kEnglish) {
  return output_of(
      emulator::Guesser({.json = false, .language = language, .motor_of = motor_sold_as}), lines);
}

/// Returns the output objects; the last is the summary.
inline std::vector<Json> guessed(const std::vector<std::string>& lines) {
  return json_lines(output_of(
      emulator::Guesser({.json = true, .language = {}, .motor_of = motor_sold_as}), lines));
}

/// Returns the remaining values of a switch; empty if nothing is known about it.
inline std::vector<std::string> possible_value_names(const Json& drive, std::string_view key) {
  std::vector<std::string> values;
  for (const Json& finding : drive["findings"]) {
    if (finding["key"] != key) continue;
    for (const Json& value : finding["values"]) {
      if (value["open"]) values.push_back(value["value"]);
    }
  }
  return values;
}

/// Returns the drives that a printed command starts, parsed as by the program.
inline std::vector<emulator::BusConfig> started(const std::string& command) {
  std::istringstream stream(command);
  const std::vector<std::string> words{std::istream_iterator<std::string>(stream), {}};
  std::vector<const char*> arguments;
  for (const std::string& word : words) arguments.push_back(word.c_str());
  const auto line =
      emulator::parse_command_line(static_cast<int>(arguments.size()), arguments.data());
  return emulator::default_config(line.value().run.overrides, profile);
}

}  // namespace lk::test
