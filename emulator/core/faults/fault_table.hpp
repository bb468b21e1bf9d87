#pragma once

/// @file Table of all faults: words, parameters, units and functions. Configuration, listings,
/// documents and injection use it.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "emulator/core/bus/host_side.hpp"
#include "emulator/core/fault.hpp"
#include "emulator/core/language.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::model {
struct Faults;
}

namespace lk::emulator {

struct AdapterEffects;
struct AdapterTimes;
struct AtOnce;
struct Babble;
struct FirmwareFaults;
struct LiveFault;
struct OnBabble;
struct OnPlant;
struct OnQuery;
struct OnRead;
struct OnReply;
struct OnWire;
struct ServoConfig;

enum class FaultGroup : std::uint8_t {
  kLink,
  kSensors,
  kPowerStage,
  kMechanics,
  kPower,
  kFirmware
};
std::string_view to_string(FaultGroup group);

/// Parameter of a kind of fault. Its word ends with its unit, if it has one.
struct FaultParam {
  std::string_view word;  // "percent"; empty: no further parameter
  double min = 0, max = 0;
  FaultValue fallback = {};                        // value if it is not given
  bool required = false;                           // must be given
  bool whole = false;                              // integers only
  std::span<const std::string_view> choices = {};  // words to choose from; min, max are unused then
};

/// A kind of fault. A function is null where the fault does not act (faults/acts.hpp).
struct FaultRow {
  std::string_view word;  // "encoder_stuck"
  FaultGroup group = FaultGroup::kLink;
  std::array<FaultParam, kMaxFaultParams> params = {};
  bool of_bus = false;     // of the whole bus: takes no drives
  bool serial = false;     // RS-485 only
  bool can = false;        // CAN only
  bool per_frame = false;  // takes a probability per frame
  bool needs_one = false;  // at least one of its parameters must be given
  /// Returns why a drive cannot have the fault; empty if it can.
  std::string (*impossible)(const Fault& fault, const ServoConfig& servo) = nullptr;

  // Plant: motor, sensors, supply, clock of the drive.
  void (*plant)(const OnPlant& on, model::Faults& sum) = nullptr;
  bool varies_in_time = false;  // its effect on the plant changes over time
  // Frames: to the drive, from the drive, and on the wire.
  void (*on_query)(OnQuery& on) = nullptr;
  void (*on_reply)(OnReply& on) = nullptr;
  bool (*destroys)(OnWire& on) = nullptr;
  SimTime (*recovery)(const LiveFault& live) = nullptr;  // extra time off the bus after a bus-off
  bool silences = false;                                 // nothing leaves the drive
  bool off_the_bus = false;                              // acknowledges nothing
  bool blocks = false;                                   // frames stay in the drive's send queue
  bool holds_back = false;                               // `on_reply` may hold a frame back
  Babble (*babble)(OnBabble& on) = nullptr;              // sends unsolicited frames
  double (*duplicate)(const LiveFault& live) = nullptr;  // second drive's rotor offset, rad
  // Adapter of the hosts: adds times to `sum`; flag in AdapterEffects that shows an effect.
  void (*adapter)(const LiveFault& live, AdapterTimes& sum) = nullptr;
  bool AdapterEffects::*adapter_shows = nullptr;
  HostCut (*cut)(const LiveFault& live) = nullptr;  // of the hosts' connection, CAN
  // RS-485 hosts: change of frames that they read; echo of frames that they send; time for which
  // they hold the line after sending.
  void (*on_read)(OnRead& on) = nullptr;
  bool echoes = false;
  SimTime (*line_hold_time)(const LiveFault& live) = nullptr;
  // Firmware and memory: flag that the fault sets, and a function that copies its parameters.
  bool FirmwareFaults::*firmware = nullptr;
  void (*firmware_detail)(const LiveFault& live, FirmwareFaults& sum) = nullptr;
  bool (*at_once)(AtOnce& on) = nullptr;  // at one instant; returns whether it changed anything
  BilingualText about = {};               // description, one sentence

  /// The fault happens at one instant and takes no duration.
  bool momentary() const { return at_once != nullptr; }
};

/// All kinds, in the order of listings.
std::span<const FaultRow> fault_table();
/// Returns the kind of this word; null if unknown.
const FaultRow* find_fault(std::string_view word);
/// Returns a fault of this kind with the defaults of its row.
Fault fault_of(const FaultRow& row);

}  // namespace lk::emulator
