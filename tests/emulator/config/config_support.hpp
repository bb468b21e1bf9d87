#pragma once

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"

namespace lk::emulator {

/// Returns the message of the ConfigError, std::invalid_argument or UnknownMotor that `parse`
/// throws.
template <typename Parse>
std::string config_error(Parse parse) {
  try {
    parse();
  } catch (const ConfigError& error) {
    return error.what();
  } catch (const std::invalid_argument& error) {
    return error.what();
  } catch (const UnknownMotor& error) {
    return error.what();
  }
  return "accepted";
}

/// Returns some test motors without reading files.
inline Profile find_test_profile(const std::string& name) {
  Profile profile;
  profile.name = name;
  if (name == "mg4005") {
    profile.series = Series::kMg;
    profile.drive.encoder.bits = 18;
    profile.drive.mechanics.gear_ratio = 10;
    profile.seen_generation = Generation::kV236;
  } else if (name == "ms3506") {
    profile.series = Series::kMs;
  } else if (name == "protected") {
    profile.factory.encoder_offset = 5000;
    profile.factory.protections[0] = {.enabled = true, .threshold = 12};
  } else if (name == "braked") {
    profile.drive.brake.tau = 1;
  } else if (name != "mf7015") {
    throw UnknownMotor("no motor \"" + name + "\"");
  }
  return profile;
}

inline std::vector<BusConfig> parse(const std::string& text, const Overrides& overrides = {}) {
  return parse_config(text, "robot.toml", overrides, find_test_profile);
}

inline std::string parse_error(const std::string& text) {
  return config_error([&] { parse(text); });
}

/// A bus up to the keys of its first event; the next line has number 10.
inline const std::string kEventBus =
    "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nids = \"2,5\"\n[[bus.drive]]\nid = 7\nmotor = "
    "\"ms3506\"\n\n[[bus.event]]\n";

inline std::vector<TimedDirective> events_of(const std::string& keys) {
  return parse(kEventBus + keys)[0].events;
}

inline std::string error_of(const std::string& keys) { return parse_error(kEventBus + keys); }

}  // namespace lk::emulator
