#include "emulator/core/faults/physical_faults.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>

#include "emulator/core/units.hpp"

namespace lk::emulator {
namespace {

/// One fault, at one of its drives, now.
struct Case {
  const LiveFault& live;
  const ServoConfig& servo;
  SimTime active;  // since it began

  double value(std::size_t n = 0) const { return live.value(n); }
  /// Where the output stood when it began, rad.
  double anchor() const {
    const auto place = std::ranges::find(live.fault.ids, servo.id) - live.fault.ids.begin();
    return live.anchors[static_cast<std::size_t>(place)];
  }
};

/// A current sensor, by the word `channel`: a, b, both.
template <class Change>
void on_channels(double channel, model::Faults& sum, Change change) {
  if (channel != 1) change(sum.current_a);
  if (channel != 0) change(sum.current_b);
}

/// Independent noises add up by their squares.
double with_noise(double noise, double more) { return std::sqrt(noise * noise + more * more); }

void set_leg(const Case& c, model::LegFault high, model::LegFault low, model::Faults& sum) {
  sum.legs[static_cast<std::size_t>(c.value(0))] = c.value(1) == 0 ? high : low;
}

/// The supply comes and goes.
bool is_off(const Case& c) {
  const auto ms = [](double value) { return SimTime(std::llround(value * 1e6)); };
  return c.active % (ms(c.value(0)) + ms(c.value(1))) < ms(c.value(0));
}

struct Row {
  FaultKind kind;
  void (*add)(const Case&, model::Faults&);
};
using F = model::Faults;
using K = FaultKind;
using model::EncoderFault;
using model::LegFault;

/// Several of a kind multiply, but to no more than one of them may be (fault_table.cpp):
/// a product of hundreds is 0 or infinite, and there is no such drive.
void times(double& so_far, double factor, double least, double most) {
  so_far = std::clamp(so_far * factor, least, most);
}

// One row a line.
// clang-format off
constexpr Row kRows[] = {
    {K::kEncoderStuck, [](const Case&, F& f) { f.encoder = EncoderFault::kStuck; }},
    {K::kEncoderGarbage, [](const Case&, F& f) { f.encoder = EncoderFault::kGarbage; }},
    {K::kEncoderLostMagnet, [](const Case&, F& f) { f.encoder = EncoderFault::kLostMagnet; }},
    {K::kEncoderJump, [](const Case& c, F& f) { f.encoder_offset += c.value() * kRadPerDeg; }},
    {K::kEncoderDrift, [](const Case& c, F& f) { f.encoder_offset += c.value() * kRadPerDeg * std::chrono::duration<double>(c.active).count(); }},
    {K::kEncoderNoise, [](const Case& c, F& f) { f.encoder_noise = with_noise(f.encoder_noise, c.value() * kRadPerDeg); }},
    {K::kEncoderSlow, [](const Case& c, F& f) { f.encoder_latency += c.value() * 1e-3; }},
    {K::kCurrentOffset, [](const Case& c, F& f) { on_channels(c.value(1), f, [&](auto& channel) { channel.offset += c.value(); }); }},
    {K::kCurrentGain, [](const Case& c, F& f) { on_channels(c.value(1), f, [&](auto& channel) { times(channel.gain, c.value(), -10, 10); }); }},
    {K::kCurrentStuck, [](const Case& c, F& f) { on_channels(c.value(1), f, [&](auto& channel) { channel.stuck = c.value(); }); }},
    {K::kCurrentNoise, [](const Case& c, F& f) { f.current_noise = with_noise(f.current_noise, c.value()); }},
    {K::kTemperatureStuck, [](const Case& c, F& f) { (c.value(1) == 0 ? f.temp_motor_stuck : f.temp_driver_stuck) = c.value(); }},
    {K::kTemperatureOff, [](const Case& c, F& f) { (c.value(1) == 0 ? f.temp_motor_offset : f.temp_driver_offset) += c.value(); }},
    {K::kVoltageStuck, [](const Case& c, F& f) { f.v_bus_stuck = c.value(); }},
    {K::kVoltageOff, [](const Case& c, F& f) { f.v_bus_offset += c.value(); }},
    {K::kPhaseOpen, [](const Case& c, F& f) { f.legs[static_cast<std::size_t>(c.value())] = LegFault::kPhaseOpen; }},
    {K::kSwitchOpen, [](const Case& c, F& f) { set_leg(c, LegFault::kHighOpen, LegFault::kLowOpen, f); }},
    {K::kSwitchShorted, [](const Case& c, F& f) { set_leg(c, LegFault::kHighShorted, LegFault::kLowShorted, f); }},
    {K::kBridgeDead, [](const Case&, F& f) { f.bridge_dead = true; }},
    {K::kJam, [](const Case& c, F& f) { f.jam = std::max(f.jam, c.value() / 100); }},
    {K::kFriction, [](const Case& c, F& f) { times(f.friction, c.value(), 0, 1000); }},
    {K::kInertia, [](const Case& c, F& f) { times(f.inertia, c.value(), 0.1, 1000); }},
    {K::kLoadStep, [](const Case& c, F& f) { f.load_torque += c.value(); }},
    {K::kBacklash, [](const Case& c, F& f) { times(f.backlash, c.value(), 0, 1000); }},
    {K::kCouplingBroken, [](const Case&, F& f) { f.coupling_broken = true; }},
    {K::kEndStop, [](const Case& c, F& f) {
       f.theta_min = std::max(f.theta_min, c.anchor() + c.value(0) * kRadPerDeg);
       f.theta_max = std::min(f.theta_max, c.anchor() + c.value(1) * kRadPerDeg);
     }},
    {K::kSag, [](const Case& c, F& f) { f.v_source_max = std::min(f.v_source_max, c.value()); }},
    {K::kDip, [](const Case& c, F& f) {
       const double below_reset_V = std::max(c.servo.profile.drive.logic.v_reset - c.value(), 0.0);
       f.v_source_max = std::min(f.v_source_max, below_reset_V);
     }},
    {K::kCut, [](const Case&, F& f) { f.supply_cut = true; }},
    {K::kRebootLoop, [](const Case& c, F& f) { f.supply_cut |= is_off(c); }},
    {K::kNoRegeneration, [](const Case&, F& f) { f.no_regeneration = true; }},
    {K::kClockDrift, [](const Case& c, F& f) { times(f.clock_ratio, 1 + c.value() / 100, 0.8, 1.2); }},
};
// clang-format on

const Row* find_row(FaultKind kind) {
  const auto* const row = std::ranges::find(kRows, kind, &Row::kind);
  return row != std::end(kRows) ? row : nullptr;
}

}  // namespace

bool is_physical(FaultKind kind) { return find_row(kind) != nullptr; }

void add_physical_fault(const LiveFault& live, const ServoConfig& servo, SimTime now,
                        model::Faults& sum) {
  if (const Row* const row = find_row(live.fault.kind)) {
    row->add({live, servo, now - live.since}, sum);
  }
}

}  // namespace lk::emulator
