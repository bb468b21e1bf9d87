// The robot's shoulder as a program for `lk-emu campaign`: swings to 90 degrees and back, and
// reports problems. Finds lk-emu's slcan and clock by environment variables; links no library of
// it. Exit status: 0: reached both angles, 3: noticed that it did not.

#include <cstdint>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <memory>
#include <string>

#include "host/shoulder_joint.hpp"
#include "slcan_can.hpp"
#include "stepped_can.hpp"

namespace {

using namespace std::chrono_literals;

constexpr int kNoticed = 3;

std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr ? value : "";
}

/// Returns the port of "slcan-tcp:29536".
std::uint16_t port_in(const std::string& bus) {
  constexpr const char* kScheme = "slcan-tcp:";
  if (!bus.starts_with(kScheme)) throw std::runtime_error("LKEMU_BUS is not slcan-tcp:PORT");
  return static_cast<std::uint16_t>(std::stoul(bus.substr(bus.rfind(':') + 1)));
}

std::unique_ptr<robot::CanPort> open_bus() {
  const std::uint16_t port = port_in(environment("LKEMU_BUS"));
  const std::string control = environment("LKEMU_CONTROL");
  if (control.empty()) return std::make_unique<robot::SlcanCan>(port);
  return std::make_unique<robot::SteppedCan>(port, control);
}

int swing(robot::CanPort& can) {
  robot::ShoulderJoint joint(can, 1);
  can.wait(200ms);  // the drive boots
  for (const double target_deg : {90.0, 0.0}) {
    if (!joint.move_and_wait(target_deg, 180, 2s)) {
      std::cout << "error: not at " << target_deg << " degrees" << std::endl;
      return kNoticed;
    }
    const auto health = joint.health();
    if (!health || !health->well()) {
      std::cout << "error: the drive is not well" << std::endl;
      return kNoticed;
    }
    std::cout << "at " << target_deg << " degrees" << std::endl;
  }
  return 0;
}

}  // namespace

int main() {
  try {
    return swing(*open_bus());
  } catch (const std::exception& problem) {
    std::cerr << "joint_host: " << problem.what() << '\n';
    return 1;
  }
}
