// Bytes of simulators at the shaft port.
//
// Input: a byte for the number of joints and the slices, then the simulator's bytes. Slices and a
// single piece give equal results. Accepted states go to a body with a drive, whose values stay
// finite.

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "emulator/core/coupling/coupling.hpp"
#include "emulator/io/shafts/shaft_body.hpp"
#include "tests/fuzz/support.hpp"
#include "tests/support/bus_config.hpp"

namespace lk::emulator {
namespace {

using fuzz::require;

constexpr SimTime kStep = std::chrono::milliseconds(1);
constexpr std::size_t kMaxStates = 20;

struct Messages {
  std::vector<ShaftAccept> accepts;
  std::vector<ShaftStates> states;
  std::string wrong;
};

Messages read(std::span<const std::uint8_t> bytes, std::uint32_t joints, std::size_t slice) {
  ShaftReader reader(joints);
  Messages messages;
  while (!bytes.empty() && messages.wrong.empty()) {
    const std::size_t size = std::min({slice, reader.bytes_missing(), bytes.size()});
    require(size > 0);
    auto message = reader.take(bytes.first(size));
    bytes = bytes.subspan(size);
    if (auto* accept = std::get_if<ShaftAccept>(&message)) messages.accepts.push_back(*accept);
    if (auto* states = std::get_if<ShaftStates>(&message)) messages.states.push_back(*states);
    if (auto* wrong = std::get_if<std::string>(&message)) messages.wrong = *wrong;
  }
  return messages;
}

/// Runs one drive on the first joint with the accepted states.
void turn(const lk_shafts_accept& terms, const std::vector<ShaftStates>& all) {
  if (terms.owner == LK_SHAFTS_NOT_COUPLED || terms.owner > LK_SHAFTS_DRIVE) return;
  Bus bus(test::bus_config({1}));
  Bus* const buses[] = {&bus};
  const double armature = bus.state().mounted_shaft(1).armature;
  auto made = std::make_unique<ShaftBody>(
      std::vector<ShaftJoint>{{"test:1", terms, 0, 0, armature}}, kStep);
  ShaftBody& body = *made;
  const CoupledDrive drive{0, 1, {}};
  Coupling coupling(std::move(made), {&drive, 1}, SimTime{0});
  for (std::size_t n = 0; n < std::min(all.size(), kMaxStates); ++n) {
    const std::span<const lk_shafts_state> first(all[n].records.data(), 1);
    if (body.problem_of(first)) return;
    body.take(first);
    coupling.begin(buses);
    bus.reach(coupling.next_due());
    coupling.finish(buses);
    const lk_shafts_torque torque = body.torques()[0];
    require(std::isfinite(torque.torque_Nm) && std::isfinite(torque.torque_slope_Nm_s));
    require(std::isfinite(torque.angle_rad) && std::isfinite(torque.speed_rad_s));
    require(std::isfinite(bus.truth(1).theta_m) && std::isfinite(bus.truth(1).omega_m));
  }
}

void check(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;
  const std::uint32_t joints = 1U + (bytes.front() & 3U);
  const std::size_t slice = 1U + (bytes.front() >> 2U);
  bytes = bytes.subspan(1);
  const Messages at_once = read(bytes, joints, std::max<std::size_t>(bytes.size(), 1));
  const Messages in_slices = read(bytes, joints, slice);
  require(at_once.wrong == in_slices.wrong);
  require(at_once.accepts.size() == in_slices.accepts.size());
  require(at_once.states.size() == in_slices.states.size());
  for (const ShaftStates& states : at_once.states) require(states.records.size() == joints);
  if (!at_once.accepts.empty()) turn(at_once.accepts[0].records[0], at_once.states);
}

}  // namespace
}  // namespace lk::emulator

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lk::emulator::check({data, size});
  return 0;
}
