#pragma once

/// @file A robot, a log and the head of a scenario, for tests of scenario files.

#include <stdexcept>
#include <string>

#include "emulator/config/scenario/config_scenario.hpp"
#include "tests/emulator/config/config_support.hpp"

namespace lk::emulator {

inline constexpr const char* kRobot = R"(
[[bus]]
interface = "vcan0"
[[bus.drive]]
id = 1
[[bus.drive]]
id = 2
motor = "mg4005"
generation = "v236"
[[bus.event]]
at_s = 1
ambient_C = 30
[[bus.event]]
at_s = 100
ambient_C = 40
[[bus]]
interface = "vcan1"
[[bus.drive]]
ids = "2-4"
)";

inline constexpr const char* kLog =
    "(1700000000.000000) can0 141#9C00000000000000 T\n"
    "(1700000000.000300) can0 141#9C19000000000000 R\n"
    "(1700000000.500000) can0 142#9A00000000000000\n"
    "(1700000001.000000) can1 141#8000000000000000\n";

inline const ScenarioFiles kFiles{
    .robot =
        [](const std::string& name, const Overrides& overrides) {
          if (name != "dog") throw std::invalid_argument("no robot \"" + name + "\"");
          return parse_config(kRobot, "dog.toml", overrides, find_test_profile);
        },
    .text = [](const std::string& name) -> std::string {
      if (name == "bad.log") return "rubbish";
      if (name == "drives.log") return "(1.000000) can0 141#9C00000000000000 R\n";
      if (name == "far.log") {  // 292 years
        return "(0.000000) can0 141#9C00000000000000\n(9223372035.900000) can0 "
               "141#8000000000000000\n";
      }
      if (name == "back.log") {
        return "(1.000000) can0 141#9C00000000000000\n(0.900000) can0 141#8000000000000000\n";
      }
      if (name != "x.log") throw std::invalid_argument("cannot read " + name);
      return kLog;
    },
};

inline constexpr const char* kHead = "robot = \"dog\"\nduration_s = 10\n";  // two lines
inline constexpr const char* kExpect = "\n[[expect]]\nid = 1\nstate = \"running\"\n";

inline Scenario parsed(const std::string& rest) {
  return parse_scenario(kHead + rest + kExpect, "dir/kick.toml", std::nullopt, kFiles);
}

inline std::string mistake(const std::string& rest) {
  return config_error([&] { parsed(rest); });
}
inline std::string expect_mistake(const std::string& rest) {
  return config_error([&] {
    parse_scenario(kHead + std::string("[[expect]]\n") + rest, "k.toml", std::nullopt, kFiles);
  });
}

}  // namespace lk::emulator
