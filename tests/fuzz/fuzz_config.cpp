// A configuration with any text: it is refused in one line, or its buses run.
//
// Input: the text of a configuration; after a line "---" that of the motor "custom", if any.

#include <cstddef>
#include <string>

#include "emulator/core/bus/bus.hpp"
#include "tests/fuzz/shipped.hpp"
#include "tests/fuzz/support.hpp"

namespace lk::emulator {
namespace {

using fuzz::require;

constexpr std::size_t kMaxDrives = 12;  // that run: limits an input to milliseconds
constexpr SimTime kRun = std::chrono::milliseconds(2);

/// Queries every drive and executes the events planned for the start. An impossible motor may
/// diverge, which verdicts report, but must have no other effect.
void run(const BusConfig& config) {
  Bus bus(config);
  bus.advance_to(kRun / 2);
  for (const ServoConfig& servo : config.servos) {
    protocol::Frame query;
    query.id = protocol::kSingleDriveId + static_cast<std::uint32_t>(servo.id);
    query.dlc = 8;
    query.data[0] = 0x9C;
    bus.receive({bus.time(), query});
  }
  bus.advance_to(kRun);
}

void check(std::string text) {
  const std::string config = fuzz::take_part(text);
  const FindMotorFile find_file = [&](const std::string& name) -> MotorFile {
    return name == "custom" ? MotorFile{name, "custom.toml", text} : fuzz::shipped_motor(name);
  };
  const FindProfile find = [&](const std::string& name) {
    return name == "custom" ? parse_profile(find_file(name), find_file)
                            : fuzz::shipped_profile(name);
  };
  try {
    const std::vector<BusConfig> buses = parse_config(config, "config.toml", {}, find);
    require(!buses.empty());
    std::size_t drives = 0;
    for (const BusConfig& bus : buses) drives += bus.servos.size();
    if (drives > kMaxDrives) return;
    for (const BusConfig& bus : buses) run(bus);
  } catch (const ConfigError& problem) {
    fuzz::require_one_line(problem.what());
  } catch (const UnknownMotor& problem) {
    fuzz::require_one_line(problem.what());
  } catch (const std::invalid_argument& problem) {
    fuzz::require_one_line(problem.what());
  }
}

}  // namespace
}  // namespace lk::emulator

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lk::emulator::check({reinterpret_cast<const char*>(data), size});
  return 0;
}
