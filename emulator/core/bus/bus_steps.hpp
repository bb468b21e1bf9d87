#pragma once

/// @file Functions that act on a BusState. Some of them are members of class Bus (bus.hpp).

#include <cstdint>
#include <optional>

#include "emulator/core/bus/bus_state.hpp"

namespace lk::emulator {

// bus.cpp: frames between hosts, wire and drives, in the order of time.
/// Returns false if the hosts' adapter refuses the frame, because its queue is full.
bool receive(BusState& bus, const TimedFrame& in);
bool advance_to(BusState& bus, SimTime until);
bool deliver_to(BusState& bus, SimTime until);
std::optional<SimTime> next_due(const BusState& bus);
void restore_rom(BusState& bus, int id, const Registers& rom, const RomWear& wear);
/// Passes a frame from the wire to the hosts, through their adapter.
void to_host(BusState& bus, TimedFrame frame);

// bus_host.cpp: the hosts' side of a CAN bus.
/// Queues a frame that is ready for the wire at `ready`. Returns false if the adapter refuses it.
bool queue_from_host(BusState& bus, SimTime ready, const TimedFrame& in);
/// Returns true if a node acknowledges the frames of hosts.
bool has_receiver(BusState& bus);
/// Call instead of a delivery if no node acknowledges the hosts' frame that is due.
void repeat_unacknowledged(BusState& bus, const protocol::Frame& frame);
/// Counts a frame of a host that waited for an acknowledgement, now that it has one.
void count_sent(BusState& bus, const WireDelivery& sent);
/// Returns true, and counts the loss, if the frame cannot reach the hosts.
bool is_cut_off(BusState& bus, const TimedFrame& frame);
void set_host_cut(BusState& bus, HostCut cut);

// bus_motors.cpp: advancing the motors, and controllers that die or start.
enum class Advance : std::uint8_t {
  kReached,
  kPowerEdge,  // stopped at the first earlier instant at which a drive dies or starts
  kWaiting,    // shared motors have not reached the time
};
bool settle(BusState& bus);
bool reach(BusState& bus, SimTime t);
/// Advances all motors to `t`, or only the motor of `one` and those that are computed with it.
Advance advance_motors_to(BusState& bus, SimTime t, const Node* one = nullptr);
/// As `advance_motors_to`, for the drives that the events due by `t` affect.
Advance advance_affected_motors_to(BusState& bus, SimTime t);
void power_cycle(BusState& bus, int id);
/// Restarts the controller of a drive. Pre: the drive's motor is at the time of the bus.
void restart(BusState& bus, Node& node);
/// Updates the bus after the firmware of `node` has started, perhaps at another address.
void on_controller_start(BusState& bus, Node& node);
/// Updates the bus after the ID, bus or bit rate in force of `node` has changed.
void on_address_change(BusState& bus, Node& node);

// bus_queries.cpp: reaction of drives to frames of hosts.
void process_query(BusState& bus, SimTime at, const protocol::Frame& frame);
/// Schedules the next step of Node::unasked, if there is one.
void schedule_unasked(BusState& bus, Node& node);
/// Call at the end of each half of a calibration (0x18). Begins the second half, or replies.
void step_calibration(BusState& bus, Node& node);

// bus_directives.cpp: actions besides sending frames.
bool apply(BusState& bus, const Directive& directive);
bool plan(BusState& bus, const TimedDirective& planned);
bool plan_as_configured(BusState& bus, const TimedDirective& event);
bool write_setting(BusState& bus, int id, RomParameter parameter, const Registers& value);
void perform(BusState& bus, const Task& task);
void sample(BusState& bus);

// bus_faults.cpp: beginning, end, effects and evidence of faults.
void begin_fault(BusState& bus, std::size_t fault);
void end_fault(BusState& bus, std::size_t fault);
void sample_faults(BusState& bus);
/// Lets a fault destroy the CAN frame that is due, or spoil a byte of the RS-485 frame that is due.
/// Returns true if the frame is destroyed.
bool destroy_next(BusState& bus);
/// Returns the transmit error counter of the sender of `frame`.
int& transmit_errors(BusState& bus, const WireCandidate& frame);

}  // namespace lk::emulator
