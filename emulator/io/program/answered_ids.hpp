#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>

#include "emulator/io/live/line.hpp"
#include "emulator/io/transports/id_locks.hpp"

namespace lk::emulator {

/// Returns options for a bus that needs no CAN in the kernel, and how a host connects to it.
std::string offer_without_can();
/// Returns the error message for missing bus options, with options that work on this machine.
std::string bus_offer();

/// Locks the IDs at which the drives answer. Logs a warning if an ID is not the configured one.
class AnsweredIds {
 public:
  /// Locks the configured IDs of `bus`; call before anything is created. `link`: state of the
  /// interface. Throws StartError if another program uses an ID.
  void take(const BusConfig& bus, const LinkState& link);
  /// Locks the IDs that the drives have from their ROM; releases the other IDs. Throws StartError
  /// as `take`.
  void start(const Line& line);
  /// Updates the locks after an address change. If another program uses a new ID, logs a warning,
  /// and both programs answer.
  void update(const Line& line);
  void drain_queue() const { locks_.drain_queue(); }

 private:
  enum class Taken : std::uint8_t { kOrFail, kOrWarn };
  void lock(const Line& line, Taken taken);
  void log_changes(const Line& line);

  using Drive = std::pair<std::string, int>;  // an interface and an ID
  IdLocks locks_;
  std::map<std::string, LinkState> links_;  // by interface
  std::map<Drive, std::string> logged_;     // last note on a drive's address; by configured ID
  std::set<Drive> shared_;  // IDs that another program uses too; the warning is logged
};

/// Returns " (7 answers at ID 9)" if drives have not their configured address; otherwise empty.
std::string moved_text(const Line& line);

}  // namespace lk::emulator
