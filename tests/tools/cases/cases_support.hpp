#pragma once

/// @file Cases of a short scenario, and their results, for tests.

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "emulator/core/faults/fault_table.hpp"
#include "tests/support/temp_directory.hpp"
#include "tools/cases/case_batch.hpp"

namespace lk::test {

using emulator::Json;

/// A directory with two scenarios of a quarter of a second: move.toml, two drives with gears and
/// brakes on CAN with an adapter, and serial.toml, one drive on RS-485.
class Cases : public testing::Test {
 protected:
  Cases() {
    const std::string drive = "[[bus.drive]]\nmotor = \"mg8016\"\ngeneration = \"v236\"\n";
    put("can.toml", "seed = 1\n[[bus]]\ninterface = \"vcan0\"\nadapter = \"usb_can\"\n" + drive +
                        "id = 2\nprofile.brake = { tau_mNm = 20000, engage_ms = 20, "
                        "release_ms = 30 }\nquirks = { brake_command = true }\n" +
                        drive + "id = 1\n");
    put("rs485.toml",
        "seed = 1\n[[bus]]\ninterface = \"rs485:lk485\"\n[[bus.drive]]\nid = 1\n"
        "motor = \"mg4005\"\ngeneration = \"v236\"\n");
    put("move.toml", "robot = \"can.toml\"\nduration_s = 0.25\n" + asks(2) + kMoves +
                         "[[expect]]\nsays = \"drive 2 does not turn\"\nid = 2\n"
                         "signal = \"true_speed_dps\"\nmin = -1\nmax = 1\nfrom_s = 0\n");
    put("serial.toml", "robot = \"rs485.toml\"\nduration_s = 0.25\n" + asks(1) + kMoves);
  }

  std::string path(const std::string& name) const { return own_.path(name); }
  std::string put(const std::string& name, const std::string& text) const {
    return own_.put(name, text);
  }
  std::string text_of(const std::string& name) const { return own_.text_of(name); }

  /// A case of `scenario` with what `more` adds.
  Json one(std::uint64_t number, const Json& more = Json::object(),
           const std::string& scenario = "move.toml") const {
    Json line{{"case", number}, {"scenario", path(scenario)}};
    line.update(more);
    return line;
  }
  static Json fault(double at_s, const Json& what, int id = 1) {
    return {{"fault", {{"at_s", at_s}, {"id", id}, {"fault", what}}}};
  }

  /// The lines of results by number, of cases that one thread takes at once.
  static std::map<std::uint64_t, std::string> results(const std::vector<Json>& lines,
                                                      bool check = false) {
    std::vector<emulator::CaseRequest> requests;
    for (const Json& line : lines) requests.push_back(emulator::read_case(line));
    std::map<std::uint64_t, std::string> all;
    emulator::CaseBatch().run(requests, check, [&](const std::string& text) {
      std::istringstream stream(text);
      for (std::string line; std::getline(stream, line);) {
        EXPECT_TRUE(all.emplace(Json::parse(line)["case"], line).second) << line;
      }
    });
    return all;
  }
  static Json result(const Json& line, bool check = false) {
    const auto all = results({line}, check);
    EXPECT_EQ(all.size(), 1U);
    return Json::parse(all.begin()->second);
  }

 private:
  static std::string asks(int drives) {
    std::string text;
    for (int id = 1; id <= drives; ++id) {
      const std::string drive = "\nid = " + std::to_string(id);
      text += "[[send]]\nat_s = 0.003" + drive + "\ncommand = \"state_2\"\nevery_s = 0.005\n";
      text += "[[send]]\nat_s = 0.004" + drive + "\ncommand = \"state_1\"\nevery_s = 0.05\n";
    }
    return text;
  }
  static constexpr const char* kMoves =
      "[[send]]\nat_s = 0.02\nid = 1\ncommand = \"speed\"\nspeed_dps = 360\n"
      "[[expect]]\nsays = \"drive 1 turns\"\nid = 1\nsignal = \"true_speed_dps\"\nmin = 1\n"
      "at_s = 0.2\n";

  const TempDirectory own_;
};

/// A fault of this kind with a value for each parameter that has to be given.
inline Json fault_json(const emulator::FaultRow& row) {
  Json fault{{"kind", row.word}};
  bool given = false;
  for (const emulator::FaultParam& param : row.params) {
    if (param.word.empty() || !(param.required || (row.needs_one && !given))) continue;
    given = true;
    if (!param.choices.empty()) {
      fault[std::string(param.word)] = param.choices.front();
    } else if (param.whole) {
      fault[std::string(param.word)] = static_cast<std::int64_t>(param.max);
    } else {
      fault[std::string(param.word)] = param.max / 4;
    }
  }
  return fault;
}

}  // namespace lk::test
