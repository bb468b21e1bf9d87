#pragma once

/// @file The one table of faults: words, parameters, units, and what each does where. What reads,
/// lists, documents and injects faults reads it here.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "emulator/core/fault.hpp"
#include "emulator/core/sim_time.hpp"
#include "emulator/ground/language.hpp"

namespace lk::model {
struct Faults;
}

namespace lk::emulator {

struct AdapterShown;
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

/// One parameter of a kind. Its unit is the end of its word.
struct FaultParam {
  std::string_view word;  // "percent"; empty: the kind has no more
  double min = 0, max = 0;
  FaultValue fallback = {};                        // when it is not said
  bool required = false;                           // it has to be said
  bool whole = false;                              // counted: takes no fractions
  std::span<const std::string_view> choices = {};  // a word of these; min, max do not count
};

/// A kind of fault. Where it does not act, there is no function (faults/acts.hpp).
struct FaultRow {
  std::string_view word;  // "encoder_stuck"
  FaultGroup group = FaultGroup::kLink;
  std::array<FaultParam, kMostFaultParams> params = {};
  bool of_bus = false;     // of the bus as a whole: takes no drives
  bool serial = false;     // of RS-485 alone
  bool per_frame = false;  // takes a probability, of each frame
  bool needs_one = false;  // one of its parameters has to be said
  /// Why this drive cannot have it; empty when it can.
  std::string (*impossible)(const Fault& fault, const ServoConfig& servo) = nullptr;

  // The plant: motor, sensors, supply, the drive's clock.
  void (*plant)(const OnPlant& on, model::Faults& sum) = nullptr;
  bool moves = false;  // what it does to the plant changes while it lasts
  // Frames: into the drive, out of it, and on the wire.
  void (*hear)(OnQuery& on) = nullptr;
  void (*say)(OnReply& on) = nullptr;
  bool (*destroys)(OnWire& on) = nullptr;
  SimTime (*recovery)(const LiveFault& live) = nullptr;  // more time off the bus, after a bus-off
  bool silences = false;                                 // nothing leaves the drive
  bool blocks = false;                                   // what it says stays in its queue
  bool holds_back = false;                               // `say` may hold a frame back
  Babble (*babble)(OnBabble& on) = nullptr;              // it talks without being asked
  double (*duplicate)(const LiveFault& live) = nullptr;  // a second drive, so many rad from it
  // The hosts' adapter: what it adds, and where that shows.
  void (*adapter)(const LiveFault& live, AdapterTimes& sum) = nullptr;
  bool AdapterShown::*adapter_shows = nullptr;
  // The same on RS-485: what hosts read in place of a frame, that they read what they send, and for
  // how long behind it they keep the line.
  void (*read)(OnRead& on) = nullptr;
  bool echoes = false;
  SimTime (*keeps_line)(const LiveFault& live) = nullptr;
  // Firmware and memory: which flag, and what the parameters say of it.
  bool FirmwareFaults::*firmware = nullptr;
  void (*firmware_detail)(const LiveFault& live, FirmwareFaults& sum) = nullptr;
  bool (*at_once)(AtOnce& on) = nullptr;  // done at an instant; whether it changed anything
  Words about = {};                       // what it does, a sentence

  /// Takes no duration.
  bool momentary() const { return at_once != nullptr; }
};

/// All kinds, in the order of listings.
std::span<const FaultRow> fault_table();
/// The kind of this word; none: null.
const FaultRow* find_fault(std::string_view word);
/// A fault of this kind, its parameters as its row has them.
Fault fault_of(const FaultRow& row);

}  // namespace lk::emulator
