#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>

#include "emulator/io/live/line.hpp"
#include "emulator/io/transports/id_locks.hpp"

namespace lk::emulator {

/// Returns a bus that needs no CAN in the kernel, with instructions to connect that can be copied.
std::string offer_without_can();
/// Returns a suggestion for this machine when no bus was given.
std::string bus_offer();

/// Locks the IDs at which the drives answer, and warns if they are not the configured IDs.
class AnsweredIds {
 public:
  /// Locks the configured IDs before anything is created. `link`: state of the interface. Throws
  /// StartError if another program uses an ID.
  void take(const BusConfig& bus, const LinkState& link);
  /// Locks the IDs in ROM and releases others. Throws StartError like `take`.
  void start(const Line& line);
  /// Updates locks after an address change. If another program uses the ID, both answer.
  void update(const Line& line);
  void drain_queue() const { locks_.drain_queue(); }

 private:
  enum class Taken : std::uint8_t { kOrFail, kOrWarn };
  void lock(const Line& line, Taken taken);
  void log_changes(const Line& line);

  using Drive = std::pair<std::string, int>;  // an interface and an ID
  IdLocks locks_;
  std::map<std::string, LinkState> links_;  // by interface
  std::map<Drive, std::string> logged_;     // by configured ID
  std::set<Drive> shared_;                  // also used by another program; already logged
};

/// Returns " (7 answers at ID 9)" for drives not at their configured ID; otherwise empty.
std::string moved_text(const Line& line);

}  // namespace lk::emulator
