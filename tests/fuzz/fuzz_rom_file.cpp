// A ROM file with any contents: it is refused in one line, or a drive starts with it; written
// again, it reads equal.
//
// Input: a byte of generation and series, then the text.

#include <cstddef>
#include <string>

#include "emulator/config/rom_file.hpp"
#include "emulator/core/bus/bus.hpp"
#include "emulator/core/generation.hpp"
#include "tests/fuzz/support.hpp"

namespace lk::emulator {
namespace {

using fuzz::require;

constexpr Series kSeries[] = {Series::kMf, Series::kMg, Series::kMh, Series::kMs};

ServoConfig servo_from(std::uint8_t settings) {
  ServoConfig servo;
  servo.id = 1;
  servo.generation = static_cast<Generation>(settings % 3U);
  servo.quirks = quirks_of(servo.generation);
  servo.profile.name = "mf7015";
  servo.profile.series = kSeries[settings >> 2U & 3U];
  servo.profile.drive.control.has_current_loop = servo.profile.series != Series::kMs;
  servo.rom = servo.profile.factory;
  return servo;
}

void start(const ServoConfig& servo) {
  BusConfig config;
  config.interface = "vcan0";
  config.bitrate = 0;
  config.servos = {servo};
  Bus bus(config);
  bus.advance_to(std::chrono::milliseconds(1));
}

void check(std::uint8_t settings, const std::string& text) {
  const ServoConfig before = servo_from(settings);
  ServoConfig servo = before;
  try {
    read_rom(text, "rom.toml", "vcan0", servo);
  } catch (const ConfigError& problem) {
    fuzz::require_one_line(problem.what());
    require(servo.rom == before.rom && servo.wear == before.wear);
    return;
  }
  ServoConfig again = before;
  read_rom(print_rom({"vcan0", 1, "mf7015"}, servo.rom, servo.wear), "again.toml", "vcan0", again);
  require(again.rom == servo.rom && again.wear == servo.wear);
  start(servo);
}

}  // namespace
}  // namespace lk::emulator

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 0) lk::emulator::check(data[0], {reinterpret_cast<const char*>(data + 1), size - 1});
  return 0;
}
